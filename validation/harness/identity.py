"""The identity of a result: whatever decides its bits, its time and its memory, as JSON values.

Its sources are found rather than listed: from the modules whose code makes the result, along all of
their imports, those in functions included, within this project's packages. The version of every
library imported on the way counts; so do Python, the processor, and the environment of the compiler
and of linear algebra (another ``OPENBLAS_CORETYPE`` gives other bits).

For a model from another package all files of that package count, and those of the packages that it
imports from outside the installed ones (a folder of ``PYTHONPATH``, an editable install), whatever
their versions.

A call of `importlib.import_module` is followed if its argument is a literal. A name that is
computed (`validation.models.adapter`) is not: the caller lists the adapter's module as well.
"""

import ast
import hashlib
import importlib.util
import os
import platform
import re
import sys
from collections.abc import Collection, Iterator, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from typing import Any

from validation.harness.provenance import processor, version

ROOT = Path(__file__).parents[2]  # the checkout, or where the wheel is installed
PACKAGES = ("hcm", "reference_fem", "meshes", "validation")
# Libraries whose distribution has another name, or whose results depend on another one too.
DISTRIBUTIONS = {
    "PIL": ("pillow",),
    "elastica": ("pyelastica",),
    "numba": ("numba", "llvmlite"),
    "pydantic_core": ("pydantic-core",),
    "skfem": ("scikit-fem",),
}
INSTALLED = {"site-packages", "dist-packages"}  # folders whose packages keep to their versions
ENVIRONMENT = ("NUMBA_", "OMP_", "OPENBLAS_", "MKL_")
WITHOUT_EFFECT = ("NUMBA_CACHE_DIR", "NUMBA_CACHE_LOCATOR_CLASSES", "NUMBA_COLOR_SCHEME")

# Parsing a package of this project takes a tenth of a second; this finds its imports in a
# hundredth. Their style is checked: no line imports two modules.
IMPORT = re.compile(
    r"^[ \t]*(?:from[ \t]+([\w.]+)[ \t]+import[ \t]*(\((?:[^)#]|#[^\n]*)*\)|[^\n(]+)"
    r"|import[ \t]+([\w.]+)(?:[ \t]+as[ \t]+\w+)?[ \t]*(?:#[^\n]*)?$)",
    re.M,
)
COMMENT = re.compile(r"#[^\n]*")
NAMED = re.compile(r"import_module\(\s*[\"']([\w.]+)[\"']")
FOR_TYPES = re.compile(r"^([ \t]*)if TYPE_CHECKING:.*\n(?:\1[ \t]+.*\n|[ \t]*\n)*", re.M)


def imports(text: str) -> Iterator[tuple[str, str]]:
    """Modules that a module imports when it runs, anywhere in its text, each with a member.

    ``from a import b`` gives (a, b), b a module or a member of a; else the member is "".
    """
    text = FOR_TYPES.sub("", text)
    yield from ((module, "") for module in NAMED.findall(text))
    for source, members, module in IMPORT.findall(text):
        if module:
            yield module, ""
        for member in COMMENT.sub("", members).strip("() \n").split(","):
            if member.strip():
                yield source, member.split()[0]


def parsed_imports(text: str) -> Iterator[tuple[str, str]]:
    """`imports` of code that need not keep to this project's style: several on a line, say."""
    try:
        tree = ast.parse(text)
    except (SyntaxError, ValueError):  # of another Python, or no code
        yield from imports(text)
        return
    yield from ((module, "") for module in NAMED.findall(text))
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from ((alias.name, "") for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module and not node.level:
            yield from ((node.module, alias.name) for alias in node.names)


def module_file(name: str, root: Path = ROOT) -> str:
    """The file of a module by its dotted name; raises ModuleNotFoundError if there is none."""
    path = os.path.join(root, *name.split("."))
    for file in (f"{path}.py", os.path.join(path, "__init__.py")):
        if os.path.isfile(file):
            return file
    raise ModuleNotFoundError(f"{name}: no such module below {root}")


def places(name: str) -> list[Path]:
    """Folders of another project's package, or the file of a module; none if it is not there."""
    try:
        spec = importlib.util.find_spec(name)
    except ValueError:  # it is loaded, but not from a file
        return []
    if spec is None or not (spec.has_location or spec.submodule_search_locations):
        return []
    return [Path(place) for place in spec.submodule_search_locations or [spec.origin or ""]]


def _outside(
    modules: Collection[str], packages: Collection[str]
) -> tuple[dict[str, bytes], set[tuple[str, str]]]:
    """All files, data and libraries too, of the modules' own packages, and of those that these
    import from folders that are not installed, whose version says nothing; and their imports.

    Raises ModuleNotFoundError: one of the modules' own packages is not there.
    """
    files, imported = dict[str, bytes](), set[tuple[str, str]]()
    waiting = sorted({name.partition(".")[0] for name in modules} - set(packages))
    for package in waiting:
        if not places(package):
            raise ModuleNotFoundError(f"{package}: no such module is installed")
    seen = {"", *packages, *sys.stdlib_module_names}
    while waiting:
        package = waiting.pop()
        seen.add(package)
        for place in places(package):
            base = place if place.is_dir() else place.parent
            for path in sorted(place.rglob("*")) if place.is_dir() else [place]:
                if not path.is_file() or path.parent.name == "__pycache__":
                    continue
                content = files[f"{package}/{path.relative_to(base)}"] = path.read_bytes()
                if path.suffix == ".py":
                    imported |= {*parsed_imports(content.decode("utf-8", "replace"))}
        for top in {name.partition(".")[0] for name, _ in imported} - seen:
            seen.add(top)
            if not any(INSTALLED.intersection(place.parts) for place in places(top)):
                waiting.append(top)
    return files, imported


def closure(
    modules: Collection[str],
    without: Collection[str] = (),
    root: Path = ROOT,
    packages: Collection[str] = PACKAGES,
) -> tuple[Mapping[str, bytes], frozenset[str]]:
    """The modules that these import, including themselves, and the libraries that they all import.

    modules : dotted names.
    without : packages that have no part in the result, though something imports them.
    root : folder that holds the packages.
    packages : those of this project; anything else that is imported is a library.

    Returns
    -------
    sources : by module, the content of its file; of packages outside this project, all files.
    libraries : names of packages, without those of the standard library.
    """
    sources, imported = _outside(modules, packages)
    libraries = set()
    names, seen = [*((name, "") for name in modules), *imported], set[tuple[str, str]]()
    while names:
        name, member = names.pop()
        if (name, member) in seen:
            continue
        seen.add((name, member))
        package = name.partition(".")[0]
        if not package or package in without:  # a relative import is of a package that counts
            continue
        if package not in packages:
            libraries.add(package)
            continue
        if member:
            with suppress(ModuleNotFoundError):  # if it is not a module, it is a member of one
                module_file(f"{name}.{member}", root)
                names.append((f"{name}.{member}", ""))
        if name not in sources:
            sources[name] = Path(module_file(name, root)).read_bytes()
            names += imports(sources[name].decode())
            parent = name.rpartition(".")[0]
            names += [(parent, "")] * bool(parent)  # a package runs before its modules
    return sources, frozenset(libraries - sys.stdlib_module_names)


def source_digest(sources: Mapping[str, bytes]) -> str:
    """SHA-256 of modules by name and content."""
    digest = hashlib.sha256()
    for name in sorted(sources):
        digest.update(name.encode() + b"\0" + hashlib.sha256(sources[name]).digest())
    return digest.hexdigest()


@cache  # running code does not change, even if its files do
def _sources_and_versions(
    modules: tuple[str, ...], without: tuple[str, ...]
) -> tuple[str, Mapping[str, str]]:
    """Digest of the sources, and versions of the libraries."""
    sources, libraries = closure(modules, without)
    names = sorted({name for one in libraries for name in DISTRIBUTIONS.get(one, (one,))})
    return source_digest(sources), {name: version(name) for name in names}


def program(*modules: str, without: tuple[str, ...] = ()) -> dict[str, Any]:
    """Source, versions and machine that the results of these modules depend on.

    without : packages of this project that have no part in it; see `closure`.
    """
    source, versions = _sources_and_versions(modules, without)
    environment = {
        name: value
        for name, value in sorted(os.environ.items())
        if name.startswith(ENVIRONMENT) and name not in WITHOUT_EFFECT
    }
    return {
        "source": source,
        "versions": dict(versions),
        "python": platform.python_version(),
        "machine": [platform.machine(), platform.system(), processor()],
        "environment": environment,
    }
