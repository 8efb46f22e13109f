"""The energy of the processor's packages, from files like the kernel's."""

import pytest

from harness.system import rapl

MOST = 262_143_328_850  # µJ


@pytest.fixture
def packages(tmp_path):
    """A function that sets the counters of two packages; beside them are zones that are none."""

    def put(*counters, most=MOST):
        zones = {"intel-rapl:0": "package-0", "intel-rapl:1": "package-1", "intel-rapl:2": "psys",
                 "intel-rapl:0:0": "core", "intel-rapl-mmio:0": "package-0"}  # fmt: skip
        for zone, name in zones.items():
            folder = tmp_path / zone
            folder.mkdir(exist_ok=True)
            (folder / "name").write_text(f"{name}\n")
            (folder / "max_energy_range_uj").write_text(f"{most}\n")
            (folder / "energy_uj").write_text("7\n")
        for number, counter in enumerate(counters):
            (tmp_path / f"intel-rapl:{number}" / "energy_uj").write_text(f"{counter}\n")
        return tmp_path

    return put


def test_both_packages_and_nothing_else(packages):
    energy = rapl.Rapl(packages(1_000_000, 5_000_000))
    assert energy.unavailable is None and energy.joules() == 0
    packages(3_500_000, 5_250_000)
    assert energy.joules() == 2.75
    packages(4_500_000, 5_250_000)
    assert energy.joules() == 3.75


def test_a_counter_that_begins_again(packages):
    energy = rapl.Rapl(packages(MOST - 1_000_000, 0))
    packages(2_000_000, 0)
    assert energy.joules() == 3


def test_no_packages(tmp_path):
    for root in (tmp_path, tmp_path / "none"):
        energy = rapl.Rapl(root)
        assert "no RAPL" in energy.unavailable and energy.joules() is None


def test_no_permission(packages, monkeypatch):
    root = packages(1, 2)

    def refuse(file):
        raise PermissionError(13, "Permission denied", str(file))

    monkeypatch.setattr(rapl, "_read", refuse)
    energy = rapl.Rapl(root)
    assert "Permission denied" in energy.unavailable and "sudo chmod" in energy.unavailable


def test_a_counter_that_goes_away(packages):
    energy = rapl.Rapl(packages(1, 2))
    (packages(1, 2) / "intel-rapl:1" / "energy_uj").unlink()
    assert energy.joules() is None and "energy_uj" in energy.unavailable
