"""Files of densities read as OpenVDB wrote them; what cannot be read is refused."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
import vdb_files

from atmos import gridfile
from atmos.geometry import Flat
from atmos.gridfile._stream import Stream
from atmos.gridfile._vdb import entries, read
from atmos.medium import Grid, Transformed
from atmos.phase import Isotropic


i, j, k = np.meshgrid(np.arange(9), np.arange(5), np.arange(3), indexing="ij")
BLOCK = 0.25 + i / 8.0 + j / 2.0 + 2.0 * k
ROOM = np.pad(BLOCK, 1)


@pytest.fixture
def written(tmp_path):
    def write(name, change=lambda raw: raw):
        path = tmp_path / f"{name}.vdb"
        path.write_bytes(change(vdb_files.raw(name)))
        return path

    return write


@pytest.mark.parametrize("name", ["float", "half", "double", "zip", "none"])
def test_every_precision_and_compression_holds_the_block(name, written):
    grid = gridfile.load(written(name), "density")
    assert isinstance(grid, Grid)
    np.testing.assert_array_equal(grid.values, ROOM)
    np.testing.assert_array_equal(grid.lower, [1.5, -3.5, 4.5])
    np.testing.assert_array_equal(grid.upper, [12.5, 3.5, 9.5])


def test_grids_of_one_file_are_told_apart_by_name_and_placed(written):
    # Of two grids of the same name the first is found; half a metre a cell.
    for name in ("density", "temperature"):
        grid = gridfile.load(written("several"), name)
        np.testing.assert_array_equal(grid.values, ROOM)
        np.testing.assert_allclose(
            grid.lower, 0.5 * np.array([1.5, -3.5, 4.5]) + [1, 2, 3]
        )
        np.testing.assert_allclose(
            grid.upper, 0.5 * np.array([12.5, 3.5, 9.5]) + [1, 2, 3]
        )


def test_a_rotated_grid_stands_where_its_transform_puts_it(written):
    grid = gridfile.load(written("affine"), "density")
    assert isinstance(grid, Transformed)
    grid = jax.tree.map(lambda x: x.astype(float), grid)
    # Rows of OpenVDB's matrix: where the cell's axes go, and the origin.
    axes = np.array([[0.5, 0.1, 0.0], [-0.1, 0.5, 0.2], [0.0, 0.0, 0.25]])
    cells = np.array([[3.0, -2.0, 6.0], [7.0, 1.0, 8.0], [5.5, 0.0, 7.25], [2.0, 0, 7]])
    places = cells @ axes + [10.0, 20.0, 30.0]
    look = jax.vmap(lambda x: grid.density(Flat().locate(x)))
    due = [BLOCK[0, 0, 0], BLOCK[4, 3, 2], 0.25 + 2.5 / 8 + 1.0 + 2.5, 0.0]
    np.testing.assert_allclose(look(jnp.asarray(places)), due, atol=1e-12)


def test_active_tiles_and_what_is_inactive_count(written):
    tiles = np.asarray(gridfile.load(written("tiles"), "density").values)
    due = np.pad(np.full((16, 16, 24), 1.5), 1)
    due[9, 1, 1] = 4.0
    np.testing.assert_array_equal(tiles, due)
    # Cells that are switched off keep values of their own, of two kinds here.
    found = np.asarray(gridfile.load(written("inactive"), "density").values)
    due = np.zeros((7, 10, 3))
    due[1:-1, 1:-1, 1] = 1.0 + np.arange(40).reshape(8, 5).T
    due[2:5, 2, 1] = [7.5, 9.5, 7.5]
    np.testing.assert_array_equal(found, due)


def test_an_empty_grid_is_nothing(written):
    grid = gridfile.load(written("empty"), "density")
    assert np.all(np.asarray(grid.values) == 0.0)


@pytest.mark.parametrize("name", ["vector", "vector_half"])
def test_vectors_are_colours(name, written):
    found = gridfile._load._volumes(str(written(name)), ["colour"])[0]
    due = ROOM[..., None] * np.array([1.0, 2.0, 3.0])
    np.testing.assert_array_equal(found.values, due)


def test_an_archive_holds_densities_and_colours(tmp_path):
    path, box = tmp_path / "cloud.npz", {"lower": [0.0, 1.0, 2.0], "upper": [9, 6, 5]}
    colour = np.full((*BLOCK.shape, 3), 0.25)
    np.savez(path, thick=BLOCK, tint=colour, **box)
    grid = gridfile.load(path, "thick")
    np.testing.assert_array_equal(grid.values, BLOCK)
    np.testing.assert_allclose(grid.lower, box["lower"])
    np.testing.assert_allclose(grid.upper, box["upper"])
    media = gridfile.load_coloured(path, "thick", "tint", 2.0, Isotropic())
    media = jax.tree.map(lambda x: x.astype(float), media)
    corner = Flat().locate(jnp.array([0.5, 1.5, 2.5]))
    total = float(sum(x.profile.density(corner) for x in media))
    assert len(media) == 6 and total == pytest.approx(3 * 0.25)


REFUSED = [
    ("float", "temp", "must be one of density; got 'temp'"),
    ("bool", "inside", "must hold float, double, vec3s, vec3d .*; got Tree_bool_5_4_3"),
    ("frustum", "density", "must be placed by an affine map; got NonlinearFrustumMap"),
    ("level_set", "density", "must be a density; it is a level set"),
    ("background", "density", "must be 0 outside its cells; got 1.0"),
    ("vector", "colour", "must hold numbers; it holds vectors"),
]


@pytest.mark.parametrize("file, name, message", REFUSED)
def test_what_cannot_be_read_is_refused_by_name(file, name, message, written):
    with pytest.raises(ValueError, match=f"{file}.vdb: `{name}` {message}"):
        gridfile.load(written(file), name)


def test_values_below_0_are_refused_saying_where(written, tmp_path):
    less = lambda raw: raw.replace(np.float32(7.25).tobytes(), np.float32(-1).tobytes())
    with pytest.raises(ValueError, match=r"none.vdb: .*values\[9, 5, 3\] = -1.0"):
        gridfile.load(written("none", less), "density")
    path = tmp_path / "a.npz"
    np.savez(path, x=np.full((1, 2, 2), np.nan), lower=np.zeros(3), upper=np.ones(3))
    with pytest.raises(ValueError, match=r"a.npz: .*values\[0, 0, 0\] = nan"):
        gridfile.load(path, "x")
    with pytest.raises(ValueError, match="must be one of x; got 'y'"):
        gridfile.load(path, "y")
    with pytest.raises(ValueError, match="must be in a .vdb or .npz file"):
        gridfile.load(tmp_path / "a.txt", "x")


ONES, LOW, HIGH = np.ones((2, 2, 2)), np.zeros(3), np.ones(3)
POOR = [
    ({"x": ONES, "upper": HIGH}, "must stand beside `lower`, which is missing"),
    ({"x": ONES, "lower": HIGH, "upper": LOW}, "must have `lower` below `upper`; got"),
    ({"x": 1j * ONES, "lower": LOW, "upper": HIGH}, "real numbers in `x`; got complex"),
    ({"x": np.array([{}]), "lower": LOW, "upper": HIGH}, "in `x`; got objects"),
    ({"x": ONES[:0], "lower": LOW, "upper": HIGH}, "must have one cell or more"),
]


@pytest.mark.parametrize("arrays, message", POOR)
def test_an_archive_that_holds_no_grid_is_refused(arrays, message, tmp_path):
    np.savez(tmp_path / "a.npz", **arrays)
    with pytest.raises(ValueError, match=f"a.npz: `x` .*{message}"):
        gridfile.load(tmp_path / "a.npz", "x")


@pytest.mark.parametrize("name", ["float", "zip", "tiles"])
def test_a_file_that_is_cut_short_or_damaged_is_refused_or_read(name):
    raw, rng = vdb_files.raw(name), np.random.default_rng(0)
    for size in [0, 7, 30, 100, 400, len(raw) // 2, len(raw) - 300]:
        stream = Stream(raw[:size])
        with pytest.raises(ValueError, match="is cut short|is no OpenVDB"):
            read(stream, entries(stream)[0])
    for _ in range(60):
        broken = bytearray(raw)
        for place in rng.integers(0, 900, 3):
            broken[place] = rng.integers(0, 256)
        stream = Stream(bytes(broken))
        try:
            for entry in entries(stream):
                read(stream, entry)
        except ValueError as error:
            assert str(error)
