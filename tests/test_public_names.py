"""The names that scripts import."""

import ast
import inspect
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import pytest

import forcelab


def test_every_public_name_is_there():
    for name in forcelab.__all__:
        assert getattr(forcelab, name) is not None
    assert forcelab.load_recogniser.__module__ == "forcelab.recognition.storage"


def test_type_checkers_are_told_the_same_names():
    tree = ast.parse(Path(forcelab.__file__).read_text("utf-8"))
    (checked,) = (node for node in tree.body if isinstance(node, ast.If))
    exported = {
        alias.asname: (node.module, alias.name) for node in checked.body for alias in node.names
    }
    assert {*exported, "__version__"} == set(forcelab.__all__)
    for name, (module, real) in exported.items():
        assert forcelab.__getattr__(name) is getattr(import_module(module), real)


def test_no_module_hides_a_public_name():
    # An imported module is an attribute of its package, found before the name is looked up.
    assert not {module.name for module in iter_modules(forcelab.__path__)} & {*forcelab.__all__}


def public_functions():
    """Every function and method that scripts may call, by name."""
    for name in dir(forcelab):
        value = getattr(forcelab, name)
        if inspect.isfunction(value):
            yield name, value
        elif inspect.isclass(value):
            members = inspect.getmembers(value, inspect.isroutine)
            public = ((m, f) for m, f in members if callable(f) and not m.startswith("_"))
            yield from ((f"{name}.{m}", f) for m, f in public)


def test_every_public_name_explains_itself():
    undocumented = [
        name
        for name, function in public_functions()
        if not inspect.getdoc(function)
        or (
            "." not in name
            and not {"Parameters", "Returns", "Raises"} & set(function.__doc__.split())
        )
    ]
    undocumented += [
        name
        for name in dir(forcelab)
        if inspect.isclass(getattr(forcelab, name)) and not getattr(forcelab, name).__doc__
    ]
    assert not undocumented


def test_what_gives_a_job_and_nothing_else_is_called_so():
    for name in dir(forcelab):
        if inspect.isfunction(function := getattr(forcelab, name)):
            gives = str(inspect.signature(function).return_annotation)
            assert gives.startswith(("Generator", "EvaluationJob")) == name.endswith("_job"), name


def test_wherever_a_path_is_taken_a_text_will_do():
    parameters = [
        (name, parameter.name)
        for name, function in public_functions()
        if getattr(function, "__module__", "").startswith("forcelab")
        for parameter in inspect.signature(function).parameters.values()
        if "Path" in str(parameter.annotation) and "str" not in str(parameter.annotation)
    ]
    assert not parameters


def test_a_recogniser_is_looked_for_at_a_path_that_is_a_text(tmp_path):
    with pytest.raises(forcelab.InputError, match="There is no recogniser at"):
        forcelab.load_recogniser(str(tmp_path / "a.skops"))
