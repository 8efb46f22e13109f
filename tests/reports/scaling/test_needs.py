"""What is carried and not used: ratios, pictures and resources that can be checked by hand."""

import csv
import hashlib

import pytest
import report_tables

from reports.run import results
from reports.run.results import Missing
from reports.scaling import needs

SLOWER = {"needed": 1.0, "needed+shadows": 1.5, "needed+lens+csg": 2.0, "general": 4.0}


def digest(word):
    return hashlib.sha256(word.encode()).hexdigest()


@pytest.fixture
def told(record):
    """A function that gives rounds of 5 processes of kernels whose frames take SLOWER times as long."""

    def make(variant="cpp", kernels=tuple(SLOWER), made=record, **changes):
        rows = []
        for kernel in kernels:
            for number in range(5):
                seconds = SLOWER[kernel] * (0.2 + 0.01 * number)
                own = {
                    "cell": f"{variant}-{kernel}", "point": {"kernel": kernel},
                    "parameters": {**made(variant)["parameters"], "kernel": kernel},
                    "picture": {"file": f"pictures/{variant}-{kernel}.npy", "sha256": digest("a")}, "series": None,
                }  # fmt: skip
                cache = {"cache": "warm" if number else "cold", "compile_s": SLOWER[kernel] if number == 0 else 0.25}
                times = cache | {"frames": [seconds] * 3} if made is record else {"kernel_s": [seconds] * 3}
                rows.append(made(variant, number, **{**times, **own, **changes}))
        return rows

    return make


def the(loaded):
    (group,) = needs.kernels(loaded)
    return group, {needs.carries(cell): cell for cell in group.cells}


def test_ratios_by_hand(load, told):
    group, by_name = the(load(told()))
    assert list(by_name) == ["needed", "shadows", "lens, csg", "general"]
    assert group.base is by_name["needed"] and needs.ratio(group.base, group.base) == "1 (the baseline)"
    found = needs.ratio(by_name["shadows"], group.base)
    assert (found.value, found.low, found.high, found.processes) == pytest.approx((1.5, 1.5, 1.5, 5))
    assert needs.ratio(by_name["general"], group.base).value == pytest.approx(4)


def test_memory_is_of_processes_that_did_not_compile(load, told):
    _, by_name = the(load(told()))
    peak = needs.peak(by_name["general"])  # 2 MB, and 1 MB more in each round, of which the first compiled
    assert (peak.value, peak.processes) == (4.5e6, 4)


def test_pictures_are_compared_by_their_bytes(load, told):
    rows = told()
    rows[5]["picture"]["sha256"] = digest("b")  # a repetition of shadows
    for row in rows[15:]:
        row["picture"]["sha256"] = digest("c")  # general
    loaded = load(rows)
    group, by_name = the(loaded)
    answers = [needs.same_picture(loaded, cell, group.base) for cell in by_name.values()]
    assert answers == ["yes", "no", "yes", "no"]
    rows[0]["picture"]["sha256"] = digest("d")  # with what was needed: it is not even like itself
    loaded = load(rows)
    group, by_name = the(loaded)
    assert needs.same_picture(loaded, by_name["lens, csg"], group.base) == "no"


def test_without_a_kernel_as_needed(load, told):
    group, by_name = the(load(told(kernels=("needed+shadows", "general"))))
    assert group.base is None
    assert "not ranked here" in str(needs.ratio(by_name["general"], None))


def test_a_cell_that_failed_has_its_reason(load, told, bad):
    rows = told(kernels=("needed", "general"))
    rows[5:] = [bad("cpp", "failed", "it broke", **{k: rows[5][k] for k in ("cell", "point", "parameters")})]
    loaded = load(rows)
    group, by_name = the(loaded)
    for value in (
        needs.ratio(by_name["general"], group.base),
        needs.same_picture(loaded, by_name["general"], group.base),
    ):
        assert isinstance(value, Missing) and "it broke" in str(value)


def test_registers_of_a_gpu(load, told, gpu_record):
    loaded = load([*told(), *told("numba-cuda", made=gpu_record, told={"registers": 77})])
    first, second = needs.kernels(loaded)
    columns = {
        column.name: column for column in needs.columns(loaded, {id(c): c for g in (first, second) for c in g.cells})
    }
    assert columns["registers"].value(second.cells[0]) == 77
    assert "doctor --cuda" in str(columns["registers"].value(first.cells[0]))


def test_nothing_without_a_varied_kernel(make_run, record, told, tmp_path):
    assert needs.write(results.load(make_run([record("cpp")])), tmp_path) == ""
    assert needs.kernels(results.load(make_run(told(kernels=("general",)), name="one"))) == []


def test_in_the_report(section, told, tmp_path):
    text, figures = section(told(), needs.TITLE)
    (table,) = report_tables.tables(text)
    row = next(row for row in table if row["carries"] == "general")
    assert row["renderer"] == "cpp" and "4.00, all equal" in row.values()
    assert "Registers, local and constant memory: unavailable: it does not run on a GPU" in text
    names = [label.get_text() for label in figures["needs"].axes[0].get_yticklabels()]
    assert names == ["needed", "shadows", "lens, csg", "general"]
    with open(tmp_path / "needs-0-comparison.csv", newline="") as file:
        rows = {(row["point"], row["quantity"]): row for row in csv.DictReader(file)}
    assert float(rows["kernel = general", "time_over_needed"]["value"]) == pytest.approx(4)
    assert float(rows["kernel = needed+shadows", "compile_cold"]["value"]) == 1.5


def test_sizes_of_a_scene_with_one_kernel_are_no_needs(load, told):
    """A generated scene has one name for all sizes, and the same parameters."""
    rows = []
    for size in (1, 2):
        for row in told(kernels=("needed",)):
            rows.append(row | {"cell": f"size-{size}", "point": {"size": size}, "scene": "generated/balls.txt"})
    loaded = load(rows)
    assert len(loaded.cells) == 2 and needs.kernels(loaded) == []
