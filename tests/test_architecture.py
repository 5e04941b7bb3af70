"""The shape of the code itself."""

import ast
import importlib
import inspect
import pathlib
import pkgutil

import equinox as eqx
import pytest

import atmos


ROOT = pathlib.Path(atmos.__file__).parent

# Imports go only to rooms earlier in this list.
ROOMS = [
    "data",
    "quantity",
    "rotation",
    "polarisation",
    "reference",
    "spectrum",
    "phase",
    "geometry",
    "particle",
    "medium",
    "gridfile",
    "light",
    "surface",
    "scene",
    "transport",
    "optics",
    "colour",
    "sky",
    "solver",
    "rays",
    "camera",
    "image",
    "comparison",
    "render",
    "disk",
    "surroundings",
    "rays",
    "scenefile",
    "archive",
    "bake",
    "film",
    "checkpoint",
    "denoise",
    "cli",
]

# Every package that atmos leans on has one file or room that knows it. JAX, NumPy,
# equinox and jaxtyping are its language and may be spoken everywhere.
KNOWN_BY = {
    "colour": "reference.py",
    "cyclopts": "cli/_app.py",
    "ephem": "light/sun.py",
    "msgspec": "scenefile",
    "numcodecs": "gridfile/_stream.py",
    "OpenEXR": "image.py",
    "PIL": "image.py",
    "platformdirs": "reference.py",
    "pyoidn": "denoise.py",
    "rich": "cli/_session.py",
}


def files():
    return [x for x in ROOT.rglob("*.py") if x != ROOT / "__init__.py"]


def room(path):
    return path.relative_to(ROOT).parts[0].removesuffix(".py")


def imported(path):
    """The rooms and the packages that a file imports."""
    depth = len(path.relative_to(ROOT).parts)
    rooms, packages = set(), set()
    for node in ast.walk(ast.parse(path.read_text())):
        if isinstance(node, ast.Import):
            packages |= {name.name.split(".")[0] for name in node.names}
        elif isinstance(node, ast.ImportFrom) and node.level == 0:
            packages.add(node.module.split(".")[0])
        elif isinstance(node, ast.ImportFrom) and node.level == depth:
            names = [node.module] if node.module else [x.name for x in node.names]
            rooms |= {name.split(".")[0] for name in names}
    return rooms, packages


def test_every_room_is_in_the_list():
    assert {room(path) for path in files()} == set(ROOMS)


@pytest.mark.parametrize("path", files(), ids=lambda x: str(x.relative_to(ROOT)))
def test_imports_point_to_earlier_rooms(path):
    here = room(path)
    earlier = set(ROOMS[: ROOMS.index(here)])
    late = {there for there in imported(path)[0] - earlier if (ROOT / there).exists()}
    late |= {x for x in imported(path)[0] - earlier if (ROOT / f"{x}.py").exists()}
    assert late <= {here}


def test_every_package_is_imported_by_one_file():
    for path in files():
        for package in imported(path)[1] & set(KNOWN_BY):
            assert path.is_relative_to(ROOT / KNOWN_BY[package]), (path, package)


PRODUCTS = {"dot", "einsum", "inner", "matmul", "tensordot", "vdot", "vecdot"}


@pytest.mark.parametrize("path", files(), ids=lambda x: str(x.relative_to(ROOT)))
def test_products_of_arrays_are_in_full_precision(path):
    """By default a GPU multiplies with 10 bits: a planet's radius is off by km."""
    for node in ast.walk(ast.parse(path.read_text())):
        if not isinstance(node, ast.Call) or not isinstance(node.func, ast.Attribute):
            continue
        whose, name = ast.unparse(node.func.value), node.func.attr
        if whose in ("jnp", "lax", "jax.lax") and (name in PRODUCTS or "dot" in name):
            given = {x.arg: ast.unparse(x.value) for x in node.keywords}
            assert given.get("precision") == "'highest'", f"line {node.lineno}"


def classes():
    for info in pkgutil.walk_packages(atmos.__path__, "atmos."):
        module = importlib.import_module(info.name)
        for _, cls in inspect.getmembers(module, inspect.isclass):
            if issubclass(cls, eqx.Module) and cls.__module__ == module.__name__:
                yield cls


def test_every_class_is_abstract_or_final():
    for cls in classes():
        abstract = inspect.isabstract(cls) or bool(getattr(cls, "__abstractvars__", ()))
        assert cls.__name__.startswith("Abstract") == abstract, cls
        for base in cls.__mro__[1:]:
            if base.__module__.startswith("atmos"):
                assert base.__name__.startswith("Abstract"), (cls, base)


def test_every_public_thing_says_what_it_is():
    for info in pkgutil.walk_packages(atmos.__path__, "atmos."):
        module = importlib.import_module(info.name)
        for name, x in vars(module).items():
            named = inspect.isclass(x) or inspect.isfunction(x)
            if named and x.__module__ == module.__name__ and name[0] != "_":
                assert inspect.getdoc(x), f"{module.__name__}.{name}"
