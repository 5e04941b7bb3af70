"""What is kept of a sky is that sky to the last bit, or it is refused."""

import dataclasses
import json
import os
import shutil
import subprocess
import sys
import zipfile

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from atmos import archive, bake
from atmos.cli import main
from atmos.geometry import Flat, Spherical
from atmos.light import Sun
from atmos.medium import Medium, Uniform
from atmos.phase import Rayleigh
from atmos.scene import Scene
from atmos.solver import (
    admit,
    Bruneton,
    Columns,
    PathTracing,
    Shared,
    Shells,
    SingleScattering,
    solve,
)
from atmos.spectrum import Constant


NM = np.linspace(450.0, 650.0, 3)
SOLVER = Shared(layers=4, suns=6)


def slab(depth=0.2, zenith=0.5, ground=0.1):
    air = Medium(Uniform(0.0, 1000.0), depth / 1000.0, phase=Rayleigh())
    sun = Sun.at(zenith, 0.0, Constant(1.0))
    return Scene(Flat(), 1000.0, (air,), (sun,), ground)


@pytest.fixture(scope="module")
def kept(tmp_path_factory):
    path = tmp_path_factory.mktemp("bake") / "sky.bake"
    sky = solve(slab(), SOLVER, NM)
    bake.save(sky, path)
    return sky, path


@pytest.fixture
def copy(kept, tmp_path):
    return shutil.copy(kept[1], tmp_path / "copy.bake")


@eqx.filter_jit
def look(sky):
    return sky.radiance(jnp.zeros(3), jnp.array([0.0, 0.6, 0.8]))


@pytest.mark.parametrize("solver", [Bruneton(), Columns(), Shells(), Shared()])
def test_what_is_worked_out_for_round_worlds_is_arrays(solver):
    round = dataclasses.replace(slab(), geometry=Spherical(6.4e6))
    scene, solver, nm = admit(round, solver, NM)
    found = eqx.filter_eval_shape(solver.prepare, solver.baked(scene), nm)
    assert all(isinstance(x, jax.ShapeDtypeStruct) for x in jax.tree.leaves(found))


def test_a_sky_from_a_file_is_the_same_to_the_last_bit(kept):
    sky, path = kept
    again = bake.load(path, slab(), SOLVER, NM)
    assert eqx.tree_equal(sky, again, typematch=True)
    np.testing.assert_array_equal(look(again), look(sky))


def test_a_bake_serves_whatever_it_does_not_hang_on(kept):
    low = slab(zenith=1.2)
    found = look(bake.load(kept[1], low, SOLVER, NM))
    np.testing.assert_array_equal(found, look(solve(low, SOLVER, NM)))


def test_keys_of_random_numbers_count_and_all_lights_where_they_may(tmp_path):
    path = tmp_path / "traced.bake"
    scene, solver = slab(), PathTracing(jax.random.key(3))
    sky = solve(scene, solver, NM)
    bake.save(sky, path)
    assert eqx.tree_equal(sky.prepared, bake.load(path, scene, solver, NM).prepared)
    with pytest.raises(ValueError, match=r"`solver.key` is .*\[0, 3\] there and .* 4"):
        bake.load(path, scene, PathTracing(jax.random.key(4)), NM)
    with pytest.raises(ValueError, match=r"`scene.lights\[0\].direction` is"):
        bake.load(path, slab(zenith=0.6), solver, NM)


@pytest.mark.parametrize(
    "scene, solver, wavelength, found",
    [
        (slab(0.3), SOLVER, NM, r"`scene.media\[0\].scattering.value` is .*0.0002"),
        (
            slab(ground=0.2),
            SOLVER,
            NM,
            "`scene.ground.value` is .*0.1 there and .*0.2",
        ),
        (
            dataclasses.replace(slab(), media=()),
            SOLVER,
            NM,
            "`scene.media` is 1 items there and 0 items here",
        ),
        (slab(), Shared(layers=5, suns=6), NM, "`solver.layers` is 4 there and 5 here"),
        (
            slab(),
            Shared(layers=4, suns=6, single=SingleScattering(nodes=7)),
            NM,
            "`solver.single.nodes` is 10 there and 7 here",
        ),
        (slab(), SingleScattering(), NM, r"`solver` is .*Shared there and .*Single"),
        (slab(), SOLVER, NM + 1.0, r"`wavelength` is .*\[450.0, .* \[451.0, 551.0"),
        (slab(), SOLVER, NM[:2], r"`wavelength` is float64\[3\] .* float64\[2\]"),
        (slab(), SOLVER, np.float32(NM), "is float64.* there and float32.* here"),
    ],
)
def test_what_was_made_of_something_else_is_refused(
    kept, scene, solver, wavelength, found
):
    with pytest.raises(ValueError, match=f"sky.bake: serves another sky: .*{found}"):
        bake.load(kept[1], scene, solver, wavelength)


@pytest.mark.parametrize("key", ["VERSION", "atmos"])
def test_other_versions_are_refused(kept, monkeypatch, key):
    if key == "VERSION":
        version = bake.KIND.version
        monkeypatch.setattr(bake, "KIND", bake.KIND._replace(version=1))
        found = f"`version` is {version} there and 1 here"
    else:
        monkeypatch.setattr(archive.importlib.metadata, "version", lambda _: "9.9")
        found = "`atmos` is .* there and 9.9 here"
    with pytest.raises(ValueError, match=f"sky.bake: serves another sky: {found}"):
        bake.load(kept[1], slab(), SOLVER, NM)


def test_arrays_of_another_shape_are_refused(kept, tmp_path):
    sky = eqx.tree_at(lambda x: x.prepared.field.up, kept[0], jnp.zeros((2, 2, 2)))
    bake.save(sky, tmp_path / "odd.bake")
    found = r"odd.bake: .*`prepared.field.up` is float64\[2, 2"
    with pytest.raises(ValueError, match=found):
        bake.load(tmp_path / "odd.bake", slab(), SOLVER, NM)


@pytest.mark.parametrize("share", [0.0, 0.001, 0.3, 0.9, 0.999, 1.0])
def test_what_is_cut_short_is_refused(copy, share):
    size = os.path.getsize(copy)
    os.truncate(copy, min(int(share * size), size - 1))
    with pytest.raises(ValueError, match="copy.bake: is no bake"):
        bake.load(copy, slab(), SOLVER, NM)


def test_a_single_bit_that_changed_is_refused(copy):
    whole = bytearray(copy.read_bytes())
    for at in [0, 40, len(whole) // 2, len(whole) - 100, len(whole) - 1]:
        whole[at] ^= 4
        with open(copy, "wb") as file:
            file.write(whole)
        whole[at] ^= 4
        with pytest.raises(ValueError, match="copy.bake: is no bake"):
            bake.load(copy, slab(), SOLVER, NM)


def test_other_files_are_refused(tmp_path):
    text, archive = tmp_path / "text", tmp_path / "archive.npz"
    text.write_text("[planet]\n" * 100)
    np.savez(archive, header=np.zeros(100))
    for path in (text, archive):
        with pytest.raises(ValueError, match=f"{path.name}: is no bake"):
            bake.load(path, slab(), SOLVER, NM)
    with pytest.raises(FileNotFoundError):
        bake.load(tmp_path / "none", slab(), SOLVER, NM)
    with pytest.raises(IsADirectoryError):
        bake.load(tmp_path, slab(), SOLVER, NM)


def test_the_errors_of_solving_come_first(kept):
    with pytest.raises(ValueError, match="`scene.media` must not scatter more"):
        bake.load(kept[1], slab(2.0), SOLVER, NM)


def test_a_solver_that_works_nothing_out_has_nothing_to_keep(tmp_path):
    path = tmp_path / "none.bake"
    sky = solve(slab(), SingleScattering(), NM)
    with pytest.raises(ValueError, match="`sky` must hold .* SingleScattering works"):
        bake.save(sky, path)
    assert not os.listdir(tmp_path)


def test_what_stops_the_writing_leaves_all_as_it_was(kept, tmp_path, monkeypatch):
    path = tmp_path / "new.bake"
    written = np.savez

    def stop(file, **arrays):
        written(file, **arrays)
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr(np, "savez", stop)
        with pytest.raises(KeyboardInterrupt):
            bake.save(kept[0], path)
        assert not os.listdir(tmp_path)
        path.write_text("what was there")
        with pytest.raises(KeyboardInterrupt):
            bake.save(kept[0], path)
    assert path.read_text() == "what was there"
    assert os.listdir(tmp_path) == ["new.bake"]


def test_a_process_that_is_killed_leaves_no_bake(tmp_path):
    # Killed when all is written but the checksum: nothing has the file's name.
    code = (
        "import os, signal, jax, numpy as np\n"
        "from atmos import archive, bake\n"
        "archive.hashlib.sha256 = lambda *_: os.kill(os.getpid(), signal.SIGKILL)\n"
        "from types import SimpleNamespace as N\n"
        "bake._made = lambda *_: {}\n"
        "bake.save(N(prepared=np.zeros(9), scene=0, solver=0, wavelength=0), 'x.bake')"
    )
    found = subprocess.run([sys.executable, "-c", code], cwd=tmp_path)
    assert found.returncode == -9
    assert not os.path.exists(tmp_path / "x.bake")
    (left,) = os.listdir(tmp_path)
    with pytest.raises(ValueError, match="is no bake"):
        bake.load(tmp_path / left, slab(), SOLVER, NM)


def test_any_numpy_reads_the_file_and_finds_what_it_says(kept):
    with np.load(kept[1], allow_pickle=False) as arrays:
        header = json.loads(arrays["header"].tobytes())
        found = arrays["prepared.field.up"]
        np.testing.assert_array_equal(found, kept[0].prepared.field.up)
    assert (header["format"], header["version"]) == ("atmos bake", 3)
    assert header["made"]["scene.media[0].profile.top"] == "float64[] 1000.0"
    assert header["made"]["wavelength"] == "float64[3] [450.0, 550.0, 650.0]"
    with zipfile.ZipFile(kept[1]) as archive:
        assert archive.testzip() is None and len(archive.comment) == 64


SCENE = """
[planet]
shape = "flat"
top = 1e3
[sun]
zenith = 40.0
irradiance = 1.0
[[medium]]
scattering = 1e-4
profile = { kind = "uniform", bottom = 0, top = 1e3 }
phase = { kind = "isotropic" }
"""


def test_the_command_line_makes_a_bake_uses_it_and_refuses_what_does_not_fit(
    tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("ATMOS_CACHE", str(tmp_path / "cache"))
    (tmp_path / "my.toml").write_text(SCENE)

    def run(options, code=0):
        assert main(f"radiance my.toml {options}".split()) == code
        return capsys.readouterr()

    first = run("--solver shared --bake a.bake --sun-zenith 40,60").out
    made = os.stat("a.bake")
    assert run("--solver shared --bake a.bake --sun-zenith 40,60").out == first
    assert run("--solver shared --sun-zenith 40,60").out == first
    assert os.stat("a.bake").st_mtime_ns == made.st_mtime_ns

    (tmp_path / "my.toml").write_text(SCENE.replace("1e-4", "2e-4"))
    error = run("--solver shared --bake a.bake", 2).err
    assert error.count("\n") == 1
    assert "a.bake: serves another sky: `medium[0].scattering.value` is" in error
    assert "is not for --solver single" in run("--solver single --bake a.bake", 2).err
    error = run("--solver columns --bake b.bake --sun-zenith 40,60", 2).err
    assert "`--bake` serves one sun with --solver columns; got 2" in error
    error = run("--solver shared --bake no/b.bake", 2).err
    assert "`--bake` must lie in a folder that exists" in error
    assert run("--solver shared --bake .", 2).err.count("\n") == 1
