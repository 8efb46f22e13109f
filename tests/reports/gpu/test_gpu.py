"""GPU records, all made up (conftest.py): what is ranked, what is left out and says why, and numbers by hand."""

import csv

import numpy as np
import pytest
import report_tables

from reports.gpu import blocks_figure, gpu_figure, launch_figure
from reports.page import report
from reports.pictures import fault_figure
from reports.run import gpu, study
from reports.run.results import Missing
from reports.scaling import operations, roofline_figure
from reports.summary import doubts, summary

SERIES = "t,cpu_s,gpu_percent,gpu_power_w,gpu_throttle\n0.0,0.0,0,70,none\n0.5,0.5,,300,none\n1.5,1.0,100,350,none\n"


def test_a_load_pass_is_in_no_time_and_is_where_the_gpu_is_looked_at(load, gpu_record):
    slow = gpu_record(number=1, kernel_s=(9, 9, 9), **{"pass": "load", "gpu": {"power_w": 500.0, "energy_j": None}})
    results = load([gpu_record(), slow])
    (cell,) = results.cells
    assert cell.values("steady_s") == [pytest.approx(0.20025)]
    assert gpu.observed(results, cell, "power_w").value == 500
    assert gpu.observed(results, cell, "energy_j") == Missing("not reported")
    assert len(results.repetitions) == 2


def test_a_failed_load_pass_is_told_and_spoils_no_time(load, gpu_record, bad):
    results = load([gpu_record(), bad("numba-cuda", "failed", "it broke", 1, **{"pass": "load"})])
    assert results.cells[0].verdict == "ok" and not results.cells[0].unranked
    assert gpu.observed(results, results.cells[0], "power_w") == Missing("failed: it broke")
    assert "a process of its load pass is not ok: failed: it broke" in doubts.write(results)


def test_an_old_run_has_timed_repetitions_and_no_part_of_a_gpu(report_text, load, record):
    assert load([record("cpp")], name="old").cells[0].values("steady_s")
    text = report_text([record("cpp"), record("numba")])
    for word in (
        "GPU:",
        "figure 2.7",
        "figure 2.8",
        "figure 2.9",
        "figure 4.3",
        "Share of the device",
        "holds the scene",
    ):
        assert word not in text, word


def test_exhibits_and_simulators_are_in_no_comparison_and_no_failure(report_text, record, exhibit, simulated):
    text = report_text([exhibit(), simulated(kernel_s=(1e-9, 1e-9)), record("cpp"), record("numba")])
    said = text.split("## Machine")[0]
    shown = said.split("Shown, and in no comparison:")[1].split("\n\n")[1]
    assert "numba-cuda-index-fault: exhibit: the study's figure 2.9; its picture is wrong, as meant" in shown
    assert "numba-cuda: ran in the CUDA simulator" in shown
    assert "numba-cuda" not in said.split("Shown,")[0] and "Not ranked" not in said
    (times,) = report_tables.tables(text.split("## Times")[1].split("\n## ")[0])
    assert [row["renderer"].partition(",")[0] for row in times] == [
        "cpp", "numba", "numba-cuda-index-fault", "numba-cuda (simulator)",
    ]  # fmt: skip
    assert "time ÷ cpp" in text


def test_a_simulated_time_never_stands_without_a_word(report_text, simulated):
    text = report_text([simulated(n, kernel_s=(1, 7.5, 7.5)) for n in range(3)])
    told = [line for line in text.splitlines() if "7.5" in line]
    assert told and all("(simulator)" in line for line in told)


def test_an_exhibit_that_fails_is_a_failure(load, exhibit, bad):
    broken = bad("numba-cuda-index-fault", "failed", "it broke", unranked="exhibit: e")
    (cell,) = load([broken]).cells
    assert not cell.as_meant and cell.verdict == "failed: it broke; exhibit: e"
    assert "Not ranked:" in summary.write(load([broken], name="again"))


def test_the_wrong_picture_of_an_exhibit_of_a_cost_is_a_failure(load, exhibit):
    (cell,) = load([exhibit("study-python", unranked="exhibit of a cost: slow")]).cells
    assert cell.exhibit and not cell.as_meant
    assert cell.verdict == "wrong picture: 7 pixels differ; exhibit of a cost: slow"


def test_parts_of_a_frame_leave_out_the_first(load, gpu_record):
    (cell,) = load([gpu_record(kernel_s=(9, 0.1, 0.3))]).cells
    assert cell.median("kernel_s", "").value == pytest.approx(0.2)
    assert cell.median("download_s", "").value == pytest.approx(0.00025)
    assert cell.median("upload_s", "").value == pytest.approx(0.1)
    assert cell.median("end_to_end_s", "").value == pytest.approx(0.1 + 0.20025)
    parts = [{"kernel": 1, "download": 1}, None, {"kernel": 1, "download": 1}]
    (cell,) = load([gpu_record(frame_parts=parts)], name="untold").cells
    assert cell.median("kernel_s", "not told") == Missing("not told")


def test_what_a_gpu_does_not_tell_has_a_reason(report_text, tmp_path, gpu_record):
    unseen = {name: {"unavailable": f"no {name} here"} for name in ("utilisation_percent", "power_w", "throttled")}
    text = report_text([gpu_record(gpu=unseen, frame_parts=None, told={"registers": None})])
    for reason in (
        "no utilisation_percent here",
        "no throttled here",
        "no steady frames that report their parts",
        "does not report it",
    ):
        assert f"unavailable: {reason}" in text.replace("\\", "") or reason in text.replace("\\", ""), reason
    for path in (tmp_path / "report").glob("gpu-*.csv"):
        with open(path, newline="") as file:
            for row in csv.DictReader(file):
                assert row["value"] != "" and (row["value"] != "NaN" or row["note"]), row


def test_flops_are_rays_times_spheres_times_twenty_over_the_kernel(load, gpu_record):
    results = load([gpu_record(kernel_s=(9, 0.1, 0.3))])
    (cell,) = results.cells
    assert operations.flops(results, cell) == 20 * 20 * 48  # 20 rays
    assert roofline_figure.rate(results, cell).value == pytest.approx(20 * 48 * 20 / 0.2)
    assert roofline_figure.share(results, cell).value == pytest.approx(20 * 48 * 20 / 0.2 / 2e13)
    results = load([gpu_record(parameters={"precision": "float32"})], name="single")
    assert roofline_figure.peak(results, results.cells[0]) == 4e13


def test_no_share_of_the_peak_without_all_that_it_needs(load, gpu_record, simulated):
    cases = {
        "a tree": gpu_record(told={"accel": "bvh"}),
        "shapes other than spheres": gpu_record(shapes={"sphere": 1, "triangle": 4}),
        "not reported": gpu_record(shapes=None),
        "no peak": simulated(),
        "time of the kernel": gpu_record(frame_parts=None),
        "not ranked": gpu_record(agreement=None),
    }
    for number, (reason, told) in enumerate(cases.items()):
        results = load([told], name=str(number))
        found = roofline_figure.rate(results, results.cells[0])
        assert isinstance(found, Missing) and reason in found.reason
    results = load([gpu_record(device={"name": "made-up GPU", "simulated": False})], name="peak")
    assert isinstance(roofline_figure.share(results, results.cells[0]), Missing)


def test_the_curve_of_a_gpu_or_the_measurer_s_reason(load, gpu_record, simulated):
    results = load([gpu_record()], files={"series/numba-cuda.csv": SERIES})
    curve = gpu_figure.curve(results, results.records[0], "gpu_percent")
    assert curve.values.tolist() == [[0, 0], [1.5, 100]]
    told = [
        (gpu_record(measurer={"gpu": "no NVIDIA driver"}), "no NVIDIA driver"),
        (gpu_record(measurer={"gpu": {"gpu_percent": "not allowed here"}}), "not allowed here"),
        (gpu_record(series=None), "no series was stored"),
        (simulated(), "the CUDA simulator uses no GPU"),
    ]
    for number, (record, reason) in enumerate(told):
        audit = {"ticks": 0, "missed": 0, "interval_p99_s": None, "cpu_s": 0} | (record["measurer"] or {})
        results = load([record | {"measurer": audit if record["measurer"] else None}], name=str(number))
        assert gpu_figure.curve(results, results.records[0], "gpu_percent") == Missing(reason)


def sweep(gpu_record, blocks, threads=(0,), kernel=lambda w, h, t: 0.2, processes=5, **more):
    """Repetitions of numba-cuda at every block and number of threads of a picture of 4 x 4."""
    return [
        gpu_record(
            number=n,
            kernel_s=[kernel(w, h, t) * (1 + 0.01 * (n * w % 5))]
            * 2,  # the noise of a round is not that of another cell
            parameters={"block_width": w, "block_height": h, "total_threads": t},
            told={"block": f"{w}x{h}", "total_threads": max(t, w * h) if t else max(16, w * h)},
            point={"block_width": w, "block_height": h, "total_threads": t},
            cell=f"{w}-{h}-{t}",
            **more,
        )
        for w, h in blocks
        for t in threads
        for n in range(processes)
    ]


def test_a_sweep_of_threads_is_a_group_and_a_sweep_of_blocks_another(load, gpu_record):
    results = load(sweep(gpu_record, [(1, 1), (2, 2)], threads=(4, 0)))
    (lines,) = launch_figure.of_scene(results, results.scenes[0])
    assert len(lines.cells) == 4 and lines.label == "comparison, numba-cuda"
    (blocks,) = blocks_figure.of_scene(results, results.scenes[0])
    assert {gpu.block(results, cell) for cell in blocks.cells} == {(1, 1), (2, 2)}
    assert all(gpu.threads(results, cell) == 16 for cell in blocks.cells)
    results = load(sweep(gpu_record, [(1, 1), (2, 2)]), name="blocks")
    assert launch_figure.of_scene(results, results.scenes[0]) == []


def test_the_best_block_is_marked_only_if_resolved(load, gpu_record):
    results = load(sweep(gpu_record, [(1, 1), (2, 2)], kernel=lambda w, h, t: 0.2 * w))
    (group,) = blocks_figure.of_scene(results, results.scenes[0])
    figure = blocks_figure.draw(results, group)
    assert "fastest: 1 × 1" in figure.get_suptitle() and framed(figure) == [(0, 0)]
    results = load(sweep(gpu_record, [(1, 1), (2, 2)], kernel=lambda w, h, t: 0.2 + 0.001 * w), name="near")
    (group,) = blocks_figure.of_scene(results, results.scenes[0])
    figure = blocks_figure.draw(results, group)
    assert "lowest median: 1 × 1, not resolved from 2 × 2" in figure.get_suptitle() and framed(figure) == []


def framed(figure):
    """The squares of a map that stand out, as (column, row)."""
    patches = [patch for patch in figure.axes[0].patches if not patch.get_fill()]
    return [(round(patch.get_x() + 0.47), round(patch.get_y() + 0.47)) for patch in patches]


def test_a_map_of_blocks_and_totals_has_a_square_for_each_pair(load, gpu_record):
    """What is written in a square is the median of its processes: 2 s for 1 × 1 and 4 threads, .. in s."""
    seconds = {(1, 4): 2.0, (1, 16): 3.0, (2, 4): 5.0, (2, 16): 7.0}
    rows = sweep(gpu_record, [(1, 1), (2, 2)], threads=(4, 16), kernel=lambda w, h, t: seconds[w, t])
    results = load(rows)
    (group,) = launch_figure.of_scene(results, results.scenes[0])
    assert set(launch_figure.draws(results, group)) == {"threads", "threads-map"}
    figure = launch_figure.draw_map(results, group)
    axes = figure.axes[0]
    told = {text.get_position(): text.get_text().split()[0] for text in axes.texts if text.get_text()}
    assert told == {(0, 0): "2.04", (1, 0): "3.06", (0, 1): "5.10", (1, 1): "7.14"}
    assert [label.get_text() for label in axes.get_yticklabels()] == ["1 × 1", "2 × 2"] and framed(figure) == [(0, 0)]
    (group,) = launch_figure.of_scene(load(rows[:10], name="one"), results.scenes[0])
    assert set(launch_figure.draws(results, group)) == {"threads"}, "one block makes no map"


def test_a_sweep_in_the_simulator_is_drawn_with_a_mark_across(section, simulated):
    rows = sweep(simulated, [(1, 1), (2, 2)], threads=(4, 0), processes=5, kernel=lambda w, h, t: 0.2 * w)
    for title in (launch_figure.TITLE, blocks_figure.TITLE):
        text, figures = section(rows, title)
        assert "png" in text and "unavailable" not in text
    for stem in ("threads-0", "threads-map-0", "blocks-0"):
        (figure,) = [figure for name, figure in figures.items() if name.startswith(f"{stem}-comparison")]
        assert "simulated: times mean nothing" in [text.get_text() for text in figure.axes[0].texts], stem
        assert "fastest" not in (figure.get_suptitle() + figure.axes[0].get_title("left")), stem


def test_a_sweep_of_which_nothing_has_a_time_says_so(section, simulated):
    rows = sweep(simulated, [(1, 1), (2, 2)], processes=1)
    for row in rows:
        row["frames_s"] = row["frames_s"][:1]
    text, _ = section(rows, blocks_figure.TITLE)
    assert "unavailable: nothing is ranked: ran in the CUDA simulator" in text and "png" not in text


@pytest.mark.parametrize(("kind", "mark"), [("cpu", ["a processor, not a GPU: made-up CPU"]), ("gpu", []), (None, [])])
def test_a_device_that_is_a_processor_is_marked(load, gpu_record, kind, mark):
    device = gpu_record()["device"] | {"name": "made-up CPU", "type": kind}
    results = load(sweep(gpu_record, [(1, 1), (2, 2)], kernel=lambda w, h, t: 0.2 * w, device=device))
    (group,) = blocks_figure.of_scene(results, results.scenes[0])
    figure = blocks_figure.draw(results, group)
    told = [text.get_text() for text in figure.axes[0].texts if text.get_rotation()]
    assert told == mark and "fastest: 1 × 1" in figure.get_suptitle()


def test_of_many_launches_the_fastest_is_spoken_of(load, gpu_record):
    results = load(sweep(gpu_record, [(1, 1), (2, 2), (4, 4)], kernel=lambda w, h, t: 0.2 * w))
    said = summary.write(results)
    assert said.count("only numba-cuda is ranked") == 1 and "comparison, block width 1, block height 1" in said
    assert "It is the fastest of 3 launches" in said


def test_memory_kinds_are_divided_by_global(report_text, gpu_record):
    kinds = {"global": 0.4, "constant": 0.2, "shared": 0.1}
    text = report_text(
        [
            gpu_record(
                number=n, kernel_s=[seconds] * 2, parameters={"scene_memory": kind}, told={"scene_memory": kind},
                point={"scene_memory": kind},
            )
            for kind, seconds in kinds.items()
            for n in range(3)
        ]
    )  # fmt: skip
    section = text.split("## Memory that holds the scene")[1].split("\n## ")[0]
    (table,) = report_tables.tables(section)
    assert {row["memory kind"]: row["time ÷ global"].partition(" (")[0] for row in table} == {
        "global": "1", "constant": "0.500", "shared": "0.250",
    }  # fmt: skip
    assert {row["kernel"].partition(" (")[0] for row in table} == {"400 ms", "200 ms", "100 ms"}


def test_the_study_s_numbers_of_cuda_reach_numba_cuda(load, gpu_record):
    own = {"width": 512, "height": 512, "region": "0,0,512,512", "depth": 10, "precision": "float64"}
    (cell,) = load([gpu_record(parameters=own)]).cells
    assert study.show(study.find(study.TIMES_S, cell)) == "10.112 ± 0.002"
    assert study.show(study.find(study.COMPILE_S, cell)) == "about 15"


def test_exhibits_are_a_row_a_fault_and_a_column_a_block(load, exhibit, bad):
    blocks = (1, 2)
    records = [
        exhibit(f"numba-cuda-{fault}-fault", parameters={"block_width": side, "block_height": side},
                told={"block": f"{side}x{side}"}, point={"block_width": side, "block_height": side})
        for fault in ("index", "barrier")
        for side in blocks
    ]  # fmt: skip
    results = load(records)
    (group,) = fault_figure.of_scene(results, results.scenes[0])
    figure = fault_figure.draw(results, group)
    titles = [axes.get_title() for axes in figure.axes]
    assert [title for title in titles if title] == ["right", "block 1 × 1", "block 2 × 2"]
    assert len(figure.axes) == 6
    assert "44 % of pixels off" in figure.axes[1].texts[0].get_text()


def test_a_run_with_everything_twice_the_same_bytes(make_run, tmp_path, record, gpu_record, exhibit, simulated):
    size = {"width": 16, "height": 16, "region": "0,0,16,16"}
    blocks = [(w, h) for w in (1, 2, 4) for h in (1, 2)]
    records = sweep(gpu_record, blocks, threads=(16, 64, 0), kernel=lambda w, h, t: 0.2 / w + (1 / t if t else 0))
    for told in records:
        told["parameters"] |= size
        told["used"]["methods"]["total_threads"] = told["parameters"]["total_threads"] or 256
    records += [simulated(parameters=size, scene="scenes/other.txt"), exhibit(parameters=size)]
    records += [gpu_record(number=9, parameters=size, **{"pass": "load", "point": records[0]["point"]})]
    pictures = dict.fromkeys(
        ("numba-cuda", "numba-cuda-index-fault", "r.reference", "t.truth"), np.full((16, 16, 3), 0.5)
    )
    files = {f"pictures/{name}.npy": picture for name, picture in pictures.items()} | {"series/numba-cuda.csv": SERIES}
    run = make_run(records, files=files)
    for name in ("a", "b"):
        report.write(run, tmp_path / name)
    names = sorted(path.name for path in (tmp_path / "a").iterdir())
    for stem in ("threads-0", "blocks-0", "faults-0", "gpu-0", "peak-0"):
        assert any(name.startswith(stem) and name.endswith(".png") for name in names), stem
    for name in names:
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes(), name
