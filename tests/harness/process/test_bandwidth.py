"""What this machine takes to write, pack and sum the numbers of a picture is measured."""

from harness.process import bandwidth


def test_rates_are_those_of_a_machine():
    rates = [bandwidth.write_s(size) / size for size in (100, 10**5, 10**6, 10**7)]
    assert all(1e-13 < rate < 1e-8 for rate in rates), rates
    assert 1e-8 < bandwidth.pack_pixel_s() < 1e-4
    assert 1e-12 < bandwidth.checksum_s(1) < 1e-7


def test_small_blocks_are_written_as_quickly_as_the_nearest_cache():
    assert bandwidth.write_s(200) == 2 * bandwidth.write_s(100) == 200 * bandwidth.write_s(1)


def test_the_quickest_of_several_counts(monkeypatch):
    clock = iter([0.0, 5.0, 5.0, 7.0, 7.0, 10.0])
    monkeypatch.setattr(bandwidth.time, "perf_counter", lambda: next(clock))
    monkeypatch.setattr(bandwidth, "TRIES", 3)
    assert bandwidth.quickest(lambda: None) == 2.0
