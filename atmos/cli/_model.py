"""From words to fitted skies."""

import dataclasses
from collections.abc import Sequence
from typing import Annotated, Any, Literal

import numpy as np
from jaxtyping import Float

from ..quantity import deg
from ..sky import (
    AbstractFittedSky,
    CIE,
    Clamp,
    HorizontalIlluminance,
    Hosek,
    HosekRGB,
    Perez,
    Preetham,
    Refuse,
    ZenithLuminance,
)
from ._app import option, real, refuse, switch, whole
from ._options import SunPosition, World
from ._world import about, ground


_HAZY = ("preetham", "hosek", "hosek-rgb")
_FOR = {
    "turbidity": _HAZY,
    "cie_type": ("cie",),
    "zenith_luminance": ("cie",),
    "horizontal_illuminance": ("cie",),
    "direct": ("perez",),
    "diffuse": ("perez",),
    "clearness": ("perez",),
    "brightness": ("perez",),
    "colour_temperature": ("cie", "perez"),
}
MODELS = (*_HAZY, "cie", "perez")
_TURBIDITY = 3.0


@dataclasses.dataclass(frozen=True)
class Model:
    """A fitted sky, as the options describe it."""

    model: Annotated[
        Literal["preetham", "hosek", "hosek-rgb", "cie", "perez"] | None,
        option(
            "A formula instead of a world: the clear skies of Preetham et al. 1999 and "
            "of Hosek and Wilkie 2012 (spectral, or fitted as colour), the 15 standard "
            "skies of the CIE, or that of Perez et al. 1993 for any weather."
        ),
    ] = None
    turbidity: Annotated[
        float | None,
        real(
            "Haze, for preetham (2 to 6) and hosek (1 to 10).  [default: 3]",
            -1e9,
            1e9,
            "",
        ),
    ] = None
    cie_type: Annotated[
        int | None,
        whole(
            "For cie: 1 overcast, 5 uniform, 12 clear, 13 clear over a town, 15 hazy.  "
            "[default: 12]",
            1,
            15,
        ),
    ] = None
    zenith_luminance: Annotated[
        float | None, real("For cie: straight up.", 0, 1e9, "CD/M2")
    ] = None
    horizontal_illuminance: Annotated[
        float | None,
        real("For cie: on the ground, without the sun.", 0, 1e9, "LUX"),
    ] = None
    direct: Annotated[
        float | None,
        real("For perez: from the sun, on a plane facing it.", 0, 1e9, "W/M2"),
    ] = None
    diffuse: Annotated[
        float | None,
        real("For perez: from the sky, on the ground.", 0, 1e9, "W/M2"),
    ] = None
    clearness: Annotated[
        float | None,
        real("For perez: instead of the two, 1 (overcast) to 12.", -1e9, 1e9, ""),
    ] = None
    brightness: Annotated[
        float | None, real("For perez: and with it, 0.01 to 0.6.", -1e9, 1e9, "")
    ] = None
    colour_temperature: Annotated[
        float | None,
        real(
            "For cie and perez: of the daylight they are made of.  [default: 6504]",
            0,
            1e9,
            "KELVIN",
            name=("--colour-temperature", "--color-temperature"),
        ),
    ] = None
    clamp: Annotated[
        bool,
        switch("Move what a model was not fitted to to the edge of what it was."),
    ] = False

    def check(self, kinds: Sequence[str], world: World, alone: bool = True) -> None:
        """Refuses options that do not go together with models of these names.

        Nothing but models is made where they are `alone`.
        """
        names = [x for x in self._given() if x != "model"]
        for name in names:
            if not kinds:
                refuse(_spelt(name), "needs a model")
            if name in _FOR and not set(kinds) & set(_FOR[name]):
                rule = f"is for the models {', '.join(_FOR[name])}"
                refuse(_spelt(name), rule, ", ".join(kinds))
        for name, value in vars(world).items():
            if kinds and alone and value is not None and name != "ground":
                refuse(_spelt(name), "must not stand beside models", ", ".join(kinds))
        if "cie" in kinds:
            self._one_of("cie", ("zenith_luminance",), ("horizontal_illuminance",))
        if "perez" in kinds:
            self._one_of("perez", ("direct", "diffuse"), ("clearness", "brightness"))

    def bands(self, kind: str | None) -> tuple[float, ...]:
        """The wavelengths of a picture if none are asked for."""
        short = kind == "hosek" and not self.clamp
        last = Hosek.ranges["wavelength"].high if short else 780.0
        return tuple(np.arange(380.0, last + 1.0, 10.0).tolist())

    def sky(
        self,
        kind: str,
        sun: SunPosition,
        world: World,
        wavelength: Float[np.ndarray, "wl"],
    ) -> AbstractFittedSky:
        """The sky of one model."""
        zenith, azimuth, distance = sun.find() or (75.0, 40.0, 1.0)
        if zenith > 90.0 and not self.clamp:
            name = "--sun-elevation" if sun.date is None else "--date"
            rule = f"must leave the sun above the horizon with the model {kind}"
            refuse(name, rule, f"elevation {90.0 - zenith:.5g}")
        towards = {"sun_zenith": zenith * deg, "sun_azimuth": azimuth * deg}
        rest = {
            "wavelength": wavelength,
            "ground": ground(world.ground or "grass"),
            "beyond": Clamp() if self.clamp else Refuse(),
        }
        names = {x: _spelt(x) for x in (*_FOR, "wavelength", "ground")}
        names["temperature"] = "--colour-temperature"
        down = self.zenith_luminance is None
        names["value"] = "--horizontal-illuminance" if down else "--zenith-luminance"
        if self.diffuse is not None:
            for name in ("clearness", "brightness"):
                names[name] = f"the {name} of --direct and --diffuse"
        with about(names):
            return self._build(kind, towards | rest, distance)

    def _build(
        self, kind: str, given: dict[str, Any], distance: float
    ) -> AbstractFittedSky:
        if kind in _HAZY:
            kinds = {"preetham": Preetham, "hosek": Hosek, "hosek-rgb": HosekRGB}
            haze = _TURBIDITY if self.turbidity is None else self.turbidity
            return kinds[kind](turbidity=haze, **given)
        if self.colour_temperature is not None:
            given["temperature"] = self.colour_temperature
        if kind == "cie":
            up, down = self.zenith_luminance, self.horizontal_illuminance or 0.0
            scale = HorizontalIlluminance(down) if up is None else ZenithLuminance(up)
            return CIE(self.cie_type or 12, scale=scale, **given)
        given["distance"] = distance
        if self.direct is None or self.diffuse is None:
            measures = {"clearness": self.clearness, "brightness": self.brightness}
            return Perez(**measures, **given)
        return Perez.measured(direct=self.direct, diffuse=self.diffuse, **given)

    def _one_of(self, kind: str, *groups: tuple[str, ...]) -> None:
        """Refuses all but one whole group of options."""
        asked = [any(getattr(self, x) is not None for x in g) for g in groups]
        whole = [all(getattr(self, x) is not None for x in g) for g in groups]
        if sum(asked) != 1 or asked != whole:
            choices = ", or ".join(" and ".join(map(_spelt, g)) for g in groups)
            refuse(kind, f"needs {choices}, and not both")

    def __str__(self) -> str:
        return ", ".join(f"{_spelt(k)} {v}" for k, v in self._given().items())

    def _given(self) -> dict[str, Any]:
        return {k: v for k, v in vars(self).items() if v is not None and v is not False}


def _spelt(name: str) -> str:
    return f"--{name.replace('_', '-')}"
