"""VEC-1: what cpp works out in lanes by series is as exact as its NOTES.md says, and its random numbers are RND-2's."""

import subprocess

import pytest

from harness.renderer import builder, registry

PROGRAM = r"""
#include "lanes/math.hpp"
#include "lanes/random.hpp"
#include <cstdio>
#include <cstdlib>
#include <random>

// The largest errors in u: of cosine and sine, absolute; of expm1 and the logarithm, relative; and how many random
// numbers and points of a sequence are not those of one after the other.
template<typename Real>
void check(unsigned seed)
{
    constexpr int n = lane_count<Real>;
    constexpr long double u = std::numeric_limits<Real>::epsilon() / 2;
    std::mt19937 words(seed);
    long double turned = 0, grown = 0, logs = 0;
    int wrong = 0;
    std::vector<std::uint32_t> matrices(64 * Sequence::bits);  // any will do
    for (std::uint32_t& word : matrices)
        word = words();
    const Sequence sequence{matrices.data(), 64, 2, 4, 2};
    const auto worse = [](long double& worst, long double error) { worst = std::max(worst, std::abs(error)); };
    for (int round = 0; round < 30000; round++) {
        const Lanes<Real> draws = lanes_of<Real>([&](int) { return Real(words() >> 8) * Real(0x1p-24); });
        const Turn<Real> phi = turn<Real>(draws);
        const Lanes<Real> x = -draws * Real(round % 2 ? 80 : 0.01), e = expm1<Real>(x), l = logarithm<Real>(1 - draws);
        for (int k = 0; k < n; k++) {
            const long double angle = 2 * 3.14159265358979323846264338328L * draws[k];
            worse(turned, phi.cosine[k] - std::cos(angle)), worse(turned, phi.sine[k] - std::sin(angle));
            if (const long double right = std::expm1((long double)x[k]); right != 0)
                worse(grown, e[k] / right - 1);
            if (const long double right = std::log(1 - (long double)draws[k]); right != 0)
                worse(logs, l[k] / right - 1);
        }
        Integers<Real> pixel{}, path{};
        for (int k = 0; k < n; k++)
            pixel[k] = Integer<Real>(words()), path[k] = Integer<Real>(words());
        const unsigned use = words(), key = words();
        Lanes<Real> mine[4];
        draw<Real>(pixel, unsigned(round), path, use, key, mine);
        for (int k = 0; k < n; k++) {
            const Words right = philox({std::uint32_t(pixel[k]), unsigned(round), std::uint32_t(path[k]), use}, key, 0);
            for (int i = 0; i < 4; i++)
                wrong += uniform<Real>(right[std::size_t(i)]) != mine[i][k];
        }
        draw_point<Real>(pixel, path, sequence.of_lobe(3), use, key, sequence, mine[0], mine[1]);
        for (int k = 0; k < n; k++) {
            const Draws one{std::uint32_t(pixel[k]), use, key, sequence};
            const std::array<Real, 2> right = one.for_lobe(Real(), 3, std::uint32_t(path[k]), 1, 0);
            wrong += (right[0] != mine[0][k]) + (right[1] != mine[1][k]);
        }
    }
    std::printf("%Lg %Lg %Lg %d\n", turned / u, grown / u, logs / u, wrong);
}

int main(int, char** argv)
{
    check<float>(unsigned(std::atoi(argv[1])));
    check<double>(unsigned(std::atoi(argv[1])));
}
"""


@pytest.mark.parametrize("target", [["-march=native"], [], ["-march=native", "-ffast-math"]], ids=" ".join)
def test_series_and_random_numbers(target, tmp_path, seed=17):
    compiler = builder.find_compiler("c++")
    if compiler is None:
        pytest.skip(builder.MISSING["c++"])
    (tmp_path / "lanes.cpp").write_text(PROGRAM)
    words = ["-std=c++20", "-O2", "-ffp-contract=off", *target, f"-I{registry.entries()['cpp'].renderer.folder}"]
    subprocess.run([compiler, *words, tmp_path / "lanes.cpp", "-o", tmp_path / "lanes"], check=True, timeout=120)
    done = subprocess.run([tmp_path / "lanes", str(seed)], capture_output=True, text=True, check=True)
    print(f"seed {seed}\n{done.stdout}")
    for line in done.stdout.splitlines():
        turned, grown, logs, wrong = map(float, line.split())
        assert max(turned, grown, logs) < 6 and wrong == 0
