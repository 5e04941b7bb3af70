from ..quantity import Spectral, Wavelength
from .gas import AbstractGas


class CarbonDioxide(AbstractGas):
    """The air of Mars.

    Refractive index of Bideau-Mehu et al. (1973), King factor of Alms et al. (1975),
    both as in Sneep and Ubachs (2005) and He et al. (2021, table 1).
    """

    def refractivity(self, wavelength: Wavelength) -> Spectral:
        # The source has a fifth resonance, in the infrared: 1e-7 of the whole in the
        # visible, 2e-6 at 2500 nm.
        squared = 1e6 / wavelength**2  # the wavenumber squared, in um^-2
        return 1.1427e-5 * (
            5799.25 / (12.89089**2 - squared)
            + 120.05 / (8.92238**2 - squared)
            + 5.3334 / (7.50375**2 - squared)
            + 4.3244 / (6.78377**2 - squared)
        )

    def king_factor(self, wavelength: Wavelength) -> Spectral:
        return 1.1364 + 2.53e-3 * (1e6 / wavelength**2)
