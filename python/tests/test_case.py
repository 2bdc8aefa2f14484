"""Posing, changing and checking cases."""

import copy
import pickle
from pathlib import Path

import numpy as np
import pytest
import sazanami
from sazanami import Case, CaseError, UnknownKeyError

SMALL = """\
[domain]
size = ["8 mm", "8 mm", "8 mm"]
cells = [12, 12, 12]
[[liquid]]
region.sphere = { diameter = "3 mm" }
position = ["4 mm", "4 mm", "5 mm"]
[run]
until = "1 ms"
"""


@pytest.fixture
def case():
    return Case.from_text(SMALL, "small.toml")


def test_keys_are_read_in_si_units(case):
    assert case.run.until == 1e-3
    assert case.domain.size == [8e-3] * 3
    assert case.domain.cells == [12, 12, 12]
    assert case.liquid[0].region.sphere.diameter == 3e-3
    assert case.liquid[-1].position == case["liquid.0.position"]
    assert case.fluid.viscosity == "auto"
    assert len(case.liquid) == 1 and [one.position[2] for one in case.liquid] == [5e-3]
    assert "cfl" in case.fluid and "cfl" in dir(case.fluid) and "fluid" in dir(case)
    assert case.erosion.dr is None
    assert case.as_dict()["run"]["until"] == 1e-3


def test_keys_are_set_as_text_numbers_and_arrays(case):
    before = case.hash
    case.run.until = "2 ms"
    assert case.run.until == 2e-3
    case.run.until = 3e-3
    assert case.run.until == 3e-3
    case.run.until = np.float64(4e-3)
    assert case.run.until == 4e-3
    case.domain.cells = np.array([16, 16, 16])
    assert case.domain.cells == [16, 16, 16]
    case.domain.size = ["8 mm", 8e-3, "0.8 cm"]
    assert case.domain.size == [8e-3] * 3
    case.liquid[0].region = {"sphere": {"diameter": 2e-3}}
    assert case.liquid[0].region.sphere.diameter == 2e-3
    case["fluid.cfl"] = 0.3
    case.title = 'a "title"'
    assert case.fluid.cfl == 0.3 and case.title == 'a "title"'
    assert case.hash != before
    assert case.changed["fluid.cfl"] == "0.3"


def test_names_of_ones_own():
    case = Case.template("raindrop")
    case.contact["default"].friction = 0.4
    assert case.contact.default.friction == 0.4


def test_names_of_any_letters(case):
    for name in ["砂", 'a "b"', "a\\b"]:
        case.material = {name: {"density": 2500}}
        case.material[name].density = 2600
        assert case.material[name].density == 2600.0


def test_a_list_that_is_set_again_forgets_what_was_set_in_it(case):
    def drop(height):
        return {"region": {"sphere": {"diameter": 1e-3}}, "position": [4e-3, 4e-3, height]}

    case.liquid = [drop(2e-3), drop(4e-3)]
    case.liquid[1].position = [4e-3, 4e-3, 6e-3]
    assert [one.position[2] for one in case.liquid] == [2e-3, 6e-3]
    case.liquid = [drop(3e-3)]
    assert [one.position[2] for one in case.liquid] == [3e-3]
    # Negative control: what was set elsewhere stays.
    case.set({"title": "kept", "run.until": "2 ms"})
    case.liquid = [drop(5e-3), drop(2e-3)]
    assert case.title == "kept" and case.run.until == 2e-3


def test_lists_are_copies(case):
    case.domain.cells[0] = 40
    held = case.liquid[0].position
    held[0] = 1.0
    assert case.domain.cells == [12, 12, 12] and case.liquid[0].position[0] == 4e-3


def test_names_of_files_mean_the_same_in_every_case(tmp_path):
    text = Case.template("packing").text
    here = Case.from_text(text, "cases/x/small.toml")
    here.output.bed = "b.bed"
    assert Path(here.output.bed) == Path("cases/x/b.bed").absolute()
    there = Case.from_text(text, tmp_path / "small.toml")
    there.output.bed = here.output.bed
    again = Case.from_text(here.text, "cases/x/again.toml")
    here.output.bed = here.output.bed
    assert here.output.bed == there.output.bed == again.output.bed
    # Negative control: a name that is given is relative to the folder of the case.
    there.output.bed = "b.bed"
    assert Path(there.output.bed) == tmp_path / "b.bed"


def test_cases_are_changed_by_themselves(case):
    other = case.with_keys({"run.until": "5 ms", ("fluid", "cfl"): 0.2})
    assert (other.run.until, case.run.until) == (5e-3, 1e-3)
    assert case.copy().hash == case.hash
    assert Case.from_text(case.text).hash == case.hash != Case.from_text(other.text).hash


def test_unknown_keys_are_refused_with_the_nearest(case):
    with pytest.raises(CaseError) as caught:
        case.run.untill = "1 s"
    error = caught.value
    assert "did you mean `until`?" in str(error)
    assert (error.file, error.line, error.column) == ("--set", 1, 1)
    with pytest.raises(UnknownKeyError, match="did you mean `fluid.cfl`") as caught:
        case.fluid.clf
    assert caught.value.meant == "fluid.cfl"
    assert not hasattr(case, "flud") and case.run.until == 1e-3
    for absent in ["liquid.3", "liquid.7.fall.speed"]:
        with pytest.raises(IndexError):
            case[absent]
    assert case["liquid.0.fall.speed"] is None


def test_wrong_values_change_nothing(case):
    before = case.hash
    for key, value in [
        ("run.until", "1 mm"),
        ("run.until", -1.0),
        ("run.until", float("nan")),
        ("run.until", None),
        ("run.until", object()),
        ("material.sand", {"density": None}),
        ("domain.cells", [12, 12, None]),
        ("domain.cells", [1, 2]),
        ("liquid.7.position", [0.0, 0.0, 0.0]),
    ]:
        with pytest.raises(ValueError):
            case[key] = value
    assert case.hash == before


def test_errors_of_texts_name_file_line_and_column():
    with pytest.raises(CaseError) as caught:
        Case.from_text(SMALL.replace("until =", "untill ="), "wrong.toml")
    error = caught.value
    assert (error.file, error.line, error.column) == ("wrong.toml", 8, 1)
    assert error.expected == "did you mean `until`?" or "until" in (error.suggestion or "")
    assert all(finding.severity == "error" for finding in error.findings)
    assert error.exit_code == 2
    with pytest.raises(CaseError, match="this is not TOML"):
        Case.from_text("a = = b")
    with pytest.raises(CaseError, match="cannot be read"):
        Case.from_file("absent.toml")


def test_templates():
    assert set(sazanami.templates()) >= {"raindrop", "shaken_tank"}
    for name in sazanami.templates():
        assert Case.template(name).check().dt > 0
    with pytest.raises(sazanami.InputError, match="did you mean `raindrop`"):
        Case.template("raindrp")


def test_check_returns_data(case):
    check = case.check(threads=2)
    assert check.report["cell_count"] == 12**3
    assert sum(limit.rules for limit in check.limits) == 1
    assert check.limits[0].dt == pytest.approx(check.dt)
    assert 0 < check.seconds[0] <= check.seconds[1]
    assert sum(check.cost.values()) == pytest.approx(check.seconds[0])
    assert check.memory > 0 and check.disk > 0
    assert "cells" in str(check)
    coarse = Case.from_text(SMALL.replace('"3 mm"', '"0.9 mm"'))
    assert all(isinstance(found, sazanami.Finding) for found in coarse.check().warnings)
    big = case.with_keys({"domain.cells": [40000, 40000, 40000]})
    with pytest.raises((CaseError, sazanami.InputError)):
        big.check()


def test_quantities_and_explanations():
    assert sazanami.quantity("20 ms", "s") == 0.02
    assert sazanami.quantity(0.02, "s") == 0.02
    # A number is taken as one in the unit, to the bits of the text.
    assert sazanami.quantity(5, "mm") == sazanami.quantity("5 mm", "mm") == 5e-3
    assert sazanami.quantity(np.float64(0.3), "ms") == 0.3e-3 and sazanami.quantity(float("inf"), "s") == float("inf")
    with pytest.raises(sazanami.InputError):
        sazanami.quantity(5, "mmm")
    with pytest.raises(sazanami.InputError):
        sazanami.quantity("20 mm", "s")
    with pytest.raises(sazanami.InputError):
        sazanami.quantity("soon", "s")
    assert "swept" in sazanami.explain("fluid.cfl")
    with pytest.raises(UnknownKeyError):
        sazanami.explain("fluid.clf")


def test_copies(case):
    case.run.until = "2 ms"
    for other in [copy.copy(case), copy.deepcopy(case), pickle.loads(pickle.dumps(case))]:
        assert other.hash == case.hash
        other.run.until = "3 ms"
        assert case.run.until == 2e-3


def test_cases_that_mean_the_same_are_equal(case):
    written_otherwise = Case.from_text(SMALL.replace('"8 mm", "8 mm"', '"0.8 cm", "8000 um"'), "elsewhere/small.toml")
    assert written_otherwise == case and not written_otherwise != case
    assert case.with_keys({"run.until": "2 ms"}) != case and case != "small"
    assert case.with_keys({"run.until": "2 ms"}).with_keys({"run.until": "1 ms"}) == case
    with pytest.raises(TypeError):
        hash(case)


def test_keys_and_errors_go_to_other_processes_and_back(case):
    keys = pickle.loads(pickle.dumps(case.liquid[0]))
    assert keys == case.liquid[0] and keys.region.sphere.diameter == 3e-3
    for wrong in ["cfl", "clf"]:
        with pytest.raises(CaseError) as caught:
            setattr(case.fluid, wrong, -1.0)
        again = pickle.loads(pickle.dumps(caught.value))
        assert type(again) is type(caught.value) and str(again) == str(caught.value)
        assert again.findings == caught.value.findings and again.suggestion == caught.value.suggestion
    stopped = pickle.loads(pickle.dumps(sazanami.RunInterrupted("out")))
    assert stopped.folder == "out" and str(stopped) == str(sazanami.RunInterrupted("out"))


def test_only_public_names_are_listed(case):
    assert dir(sazanami) == sorted(sazanami.__all__) and not hasattr(sazanami, "errors")
    assert not [name for name in dir(case) if name.startswith("_")]
    for name in sazanami.__all__:
        module = getattr(getattr(sazanami, name), "__module__", "sazanami")
        assert module in ("sazanami", "builtins"), f"{name} is of {module}"


def test_names_of_methods_hide_no_key(case):
    keys = set(case._known(())["keys"])
    own = {name for name in dir(type(case)) if not name.startswith("_")}
    # `case.run` is both: it can be called, and its keys are those of the table.
    assert keys & own == {"run"}
    case.run = {"until": "7 ms"}
    assert case.run.until == 7e-3
