import json
import time

import pytest

from harness.renderer import events

RAYS = {"primary": 1, "reflected": 2, "transmitted": 3, "shadow": 4, "non_finite": 5}


@pytest.fixture
def read(tmp_path):
    def read(*lines):
        path = tmp_path / "stdout"
        path.write_bytes(
            b"".join(line if isinstance(line, bytes) else (json.dumps(line) + "\n").encode() for line in lines)
        )
        return events.read(path)

    return read


def phase(name="render", start=1, end=2):
    return {"event": "phase", "name": name, "start": start, "end": end}


def frame(index=0, start=1, end=2, parts=None, **more):
    return {"event": "frame", "index": index, "start": start, "end": end, **({"parts": parts} if parts else {}), **more}


def device(**more):
    return {"event": "device", "name": "a", "simulated": False, **more}


def test_all_events(read):
    said = read(
        phase("load", 1, 2.5), frame(0, 3, 4),
        frame(1, 4, 5, {"kernel": 0.25, "download": 0}, renders=3, checksums="c0ffee00" * 3),
        {"event": "rays", **RAYS}, {"event": "memory", "peak_bytes": 10},
        {"event": "versions", "compiler": {"name": "x"}}, {"event": "used", "features": [], "methods": {"threads": 1}},
        b"\n", {"event": "output", "file": "image.npy"}, {"event": "error", "reason": "so\nit is"},
    )  # fmt: skip
    assert said.faults == []
    assert said.phases == [{"name": "load", "start": 1, "end": 2.5}]
    assert said.frames == [
        {"index": 0, "start": 3, "end": 4, "parts": None, "renders": 1, "checksums": None},
        {
            "index": 1,
            "start": 4,
            "end": 5,
            "parts": {"kernel": 0.25, "download": 0},
            "renders": 3,
            "checksums": "c0ffee00" * 3,
        },
    ]
    assert said.rays == RAYS and said.output == "image.npy" and said.error == "so it is"
    assert said.memory == {
        "peak_bytes": 10,
        "render_peak_bytes": None,
        "peak_virtual_bytes": None,
        "method": "not told",
    }
    assert said.versions == {"compiler": {"name": "x"}} and said.used["methods"] == {"threads": 1}


def test_device(read):
    nothing = dict.fromkeys((*events.DEVICE_COUNTS, *events.DEVICE_NUMBERS, "driver", "type", "compute_capability"))
    assert read(device()).device == {"name": "a", "simulated": False, **nothing}
    facts = {"compute_capability": [9, 0], "multiprocessors": 132, "clock_mhz": 1980.5, "driver": "5\n7", "other": 1}
    facts["type"] = "cpu"
    said = read(device(**facts)).device
    assert (
        said.pop("driver") == "5 7"
        and said["type"] == "cpu"
        and said["compute_capability"] == [9, 0]
        and said["clock_mhz"] == 1980.5
    )
    assert "other" not in said and said["multiprocessors"] == 132 and said["memory_bytes"] is None


@pytest.mark.parametrize(
    "line",
    [
        b"text\n", b"\x00\xff\n", b"5\n", b"[]\n", b"null\n", b'"event"\n', b"{}\n", b'{"event": "frame"\n',
        b"[" * 10**5 + b"\n",
        frame(parts={"kernel": -1}), frame(parts={"kernel": "1"}), frame(parts={"kernel": True}), frame(parts=[1]),
        frame(parts={"kernel": float("nan")}), frame(parts={"kernel": 10**400}), frame(parts=3),
        *(frame(renders=n) for n in (0, -1, 1.0, True, "2", None, [2], float("inf"), 2**63)),
        frame(parts={str(n): 0 for n in range(100)}),
        *(frame(checksums=text) for text in ("", "c0ffee0", "C0FFEE00", "c0ffee00" * 2, 5, ["c0ffee00"], "c0ffee0\n")),
        {"event": "device"}, device(simulated=1), device(simulated=None), device(compute_capability=[9]),
        device(compute_capability=9), device(compute_capability=[9, 0.5]), device(multiprocessors=-1),
        device(multiprocessors="many"), device(clock_mhz="fast"), device(peak_fp32_flops=float("inf")),
        {"event": "unknown"}, {"event": ["phase"]}, {"event": None},
        phase(start=2, end=1), phase(start=float("nan")), phase(end=float("inf")), phase(start="x"), phase(start=None),
        phase(start=10**400),
        frame(index=-1), frame(index=0.5), frame(index=True), frame(index=float("inf")), frame(index="x"),
        {"event": "rays"}, {"event": "rays", **RAYS, "primary": -1}, {"event": "rays", **RAYS, "primary": 1.5},
        {"event": "rays", **RAYS, "primary": 10**400}, {"event": "rays", **RAYS, "non_finite": None},
        {"event": "memory", "peak_bytes": "1"}, {"event": "memory", "peak_bytes": float("nan")},
        {"event": "memory", "peak_bytes": -1}, {"event": "versions", "a": [float("nan")]},
        b'{"event": "used", "a": 1e999}\n', {"event": "output"}, {"event": "error"},
    ],
    ids=lambda line: str(line)[:40],
)  # fmt: skip
def test_no_event(read, line):
    said = read(phase(), line, frame())
    assert len(said.faults) == 1 and said.faults[0].startswith("line 2 of its output is no event of the contract: ")
    assert len(said.faults[0]) < 500
    assert len(said.phases) == len(said.frames) == 1


def test_texts_can_be_printed_and_stored(read):
    said = read(
        b'{"event": "error", "reason": "\\ud800 ' + b"a" * 10**6 + b'"}\n',
        b'{"event": "output", "file": "\\u0000\\udfff"}\n',
    )
    assert said.error.startswith("? aaa") and len(said.error) < 600
    (said.error + said.output).encode("utf-8")


@pytest.mark.parametrize("text", [b"x\n" * 3 * 10**7, b"y" * (events.LIMIT + 10), b"\n" * 10**6 + b"z" * events.LIMIT])
def test_huge_output_is_given_up_soon(read, text):
    start = time.monotonic()
    said = read(text)
    assert 1 <= len(said.faults) <= events.FAULTS and time.monotonic() - start < 30


def test_what_came_before_the_limit_is_kept(read):
    said = read(phase(), b"y" * (events.LIMIT + 10))
    assert len(said.phases) == 1 and said.faults == [f"printed more than {events.LIMIT} bytes"]


@pytest.mark.parametrize(
    ("lines", "fault"),
    [
        ([phase("load", 1, 2), phase("render", 2, 4), frame(0, 2, 3), frame(1, 3, 4)], None),
        ([phase("load", 0.9995, 2)], None),
        ([phase("load", 0.9, 2)], "outside the life"),
        ([frame(0, 2, 3, {"kernel": 0.6, "download": 0.405})], None),
        ([frame(0, 2, 3, {"kernel": 0.6, "download": 0.42})], "the parts of frame 0 are longer"),
        ([frame(0, 2, 3, {"kernel": 0.001}, renders=1000)], None),
        ([frame(0, 2, 3, {"kernel": 0.001}, renders=1100)], "the parts of frame 0 are longer"),
        ([phase("load", 3, 5.1)], "outside the life"),
        ([frame(0, 0, 2)], "outside the life"),
        ([phase("load", 1, 3), phase("render", 2, 4)], "before the end of the one"),
        ([phase("render", 1, 5), frame(0, 3, 4), frame(1, 2, 3)], "before the end of the one"),
        ([phase("render", 3, 4), frame(0, 2, 3)], "frame 0 lies outside the phase render"),
        ([phase("render", 1, 2), frame(0, 1, 1.5), frame(1, 1.5, 2.5)], "frame 1 lies outside the phase render"),
    ],
)
def test_stamps(read, lines, fault):
    said = read(*lines)
    events.tidy(said, 1.0, 5.0)
    assert (said.faults == []) if fault is None else (len(said.faults) == 1 and fault in said.faults[0])
