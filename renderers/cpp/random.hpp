// Numbers that are a function of what they are for (RND-1 to RND-3, SOB-1 to SOB-4): without a state, so any thread may
// draw.
#pragma once
#include "needs.hpp"

#include <array>
#include <cstdint>

using Words = std::array<std::uint32_t, 4>;

// RND-1: Philox4x32-10
constexpr Words philox(Words c, std::uint32_t k0, std::uint32_t k1)
{
    for (int round = 0; round < 10; round++) {
        const std::uint64_t p0 = std::uint64_t(0xD2511F53) * c[0], p1 = std::uint64_t(0xCD9E8D57) * c[2];
        c = {std::uint32_t(p1 >> 32) ^ c[1] ^ k0, std::uint32_t(p1),  //
             std::uint32_t(p0 >> 32) ^ c[3] ^ k1, std::uint32_t(p0)};
        k0 += 0x9E3779B9;
        k1 += 0xBB67AE85;
    }
    return c;
}

// The vectors of SPEC.md; the first three are the authors' own.
static_assert(philox({0, 0, 0, 0}, 0, 0) == Words{0x6627e8d5, 0xe169c58d, 0xbc57ac4c, 0x9b00dbd8});
static_assert(philox({~0u, ~0u, ~0u, ~0u}, ~0u, ~0u) == Words{0x408f276d, 0x41c83b0e, 0xa20bc7c6, 0x6d5451fd});
static_assert(philox({0x243f6a88, 0x85a308d3, 0x13198a2e, 0x03707344}, 0xa4093822, 0x299f31d0) ==
              Words{0xd16cfe09, 0x94fdcceb, 0x5001e420, 0x24126ea1});
static_assert(philox({1234, 5, 0, 0}, 42, 0) == Words{0x2155de9a, 0xf774bbf8, 0xfb0b0b50, 0x0edd2a24});
static_assert(philox({262143, 15, 37, 56}, 7, 0) == Words{0x82924c93, 0xe275186c, 0x4a489e55, 0xaf5eec32});
static_assert(philox({9, 1, 2, 0x80000003}, 0xffffffff, 0) == Words{0x77da3257, 0xfe76aa2d, 0x5215f5bd, 0x34d24b16});

// RND-2
template<typename Real>
constexpr Real uniform(std::uint32_t word)
{
    return Real(word >> 8) * Real(0x1p-24);
}

// SOB-3: pcg4d. Here and below, a word has 32 bits, or is a vector of such, one for each lane.
template<typename Word>
constexpr std::array<Word, 4> mixed(std::array<Word, 4> v)
{
    for (Word& word : v)
        word = word * 1664525u + 1013904223u;
    for (int round = 0; round < 2; round++) {
        v[0] += v[1] * v[3], v[1] += v[2] * v[0], v[2] += v[0] * v[1], v[3] += v[1] * v[2];
        if (round == 0)
            for (Word& word : v)
                word ^= word >> 16;
    }
    return v;
}

template<typename Word>
constexpr Word reversed(Word x)
{
    x = x >> 16 | x << 16;
    x = (x & 0xff00ff00u) >> 8 | (x & 0x00ff00ffu) << 8;
    x = (x & 0xf0f0f0f0u) >> 4 | (x & 0x0f0f0f0fu) << 4;
    x = (x & 0xccccccccu) >> 2 | (x & 0x33333333u) << 2;
    return (x & 0xaaaaaaaau) >> 1 | (x & 0x55555555u) << 1;
}

// SOB-4: whether a bit changes depends on the bits below it alone.
template<typename Word>
constexpr Word scrambled(Word x, Word key)
{
    x ^= x * 0x3d20adeau;
    x += key;
    x *= key >> 16 | 1u;
    x ^= x * 0x05526c56u;
    return x ^ x * 0x53a22864u;
}

// The points of a job with the sampler `sobol` (SOB-1, SOB-2). A purpose is the first of its two dimensions.
struct Sequence {
    static constexpr std::size_t bits = 32;
    static constexpr std::uint32_t place = 0, lens = 2;

    const std::uint32_t* matrices = nullptr;  // sobol.npy; nullptr: all numbers are random
    std::uint32_t dimensions = 0;             // rows of it
    std::uint32_t first = 0, each = 0;        // purpose of the first light at order 0; dimensions of an order
    std::uint32_t lobes = 0;                  // dimensions of the lights of an order, which lobes come after

    bool has(std::uint32_t purpose) const { return matrices && purpose < dimensions; }
    std::uint32_t of_light(int order, std::uint32_t light) const
    {
        return first + std::uint32_t(order) * each + 2 * light;
    }
    std::uint32_t of_lobe(int order) const { return first + std::uint32_t(order) * each + lobes; }

    // SOB-2: the digits of point `index`, the first one in the lowest bit.
    std::array<std::uint32_t, 2> digits(std::uint32_t index, std::uint32_t purpose) const
    {
        std::array<std::uint32_t, 2> x{};
        for (const std::uint32_t* row = matrices + purpose * bits; index != 0; index >>= 1, row++)
            if (index & 1)
                x[0] ^= row[0], x[1] ^= row[bits];
        return x;
    }
};

// Who draws (RND-3, SOB-1): a sample of a pixel. What the numbers are for comes with each draw.
struct Draws {
    std::uint32_t pixel = 0, sample = 0, seed = 0;
    Sequence sequence{};  // without the need `sobol` nobody asks for it

    // The sample's own: its place in the pixel, and on the lens.
    template<typename Real>
    std::array<Real, 4> own(Real real) const
    {
        if constexpr (needs::sobol)
            if (sequence.matrices) {
                const auto place = point(real, 0, Sequence::place, sample);
                const auto lens = point(real, 0, Sequence::lens, sample);
                return {place[0], place[1], lens[0], lens[1]};
            }
        const Words words = philox({pixel, sample, 0, 0}, seed, 0);
        return {uniform<Real>(words[0]), uniform<Real>(words[1]), uniform<Real>(words[2]), uniform<Real>(words[3])};
    }

    // SOF-2: of feeler f of `feelers` to a light, from a hit of a ray of an order.
    template<typename Real>
    std::array<Real, 2> for_feeler(Real real, [[maybe_unused]] int order, std::uint32_t path, std::uint32_t light,
                                   int feelers, int f) const
    {
        const std::uint32_t count = std::uint32_t(feelers), which = std::uint32_t(f);
        if constexpr (needs::sobol)
            if (const std::uint32_t purpose = sequence.of_light(order, light); sequence.has(purpose))
                return point(real, path, purpose, sample * count + which);
        return random(real, path, 1 + light * count + which);
    }

    // GLO-2: of glossy ray g of `rays`.
    template<typename Real>
    std::array<Real, 2> for_lobe(Real real, [[maybe_unused]] int order, std::uint32_t path, int rays, int g) const
    {
        if constexpr (needs::sobol)
            if (const std::uint32_t purpose = sequence.of_lobe(order); sequence.has(purpose))
                return point(real, path, purpose, sample * std::uint32_t(rays) + std::uint32_t(g));
        return random(real, path, 0x80000000 + std::uint32_t(g));
    }

private:
    template<typename Real>
    std::array<Real, 2> random(Real, std::uint32_t path, std::uint32_t use) const
    {
        const Words words = philox({pixel, sample, path, use}, seed, 0);
        return {uniform<Real>(words[0]), uniform<Real>(words[1])};
    }

    template<typename Real>
    std::array<Real, 2> point(Real, std::uint32_t path, std::uint32_t purpose, std::uint32_t index) const
    {
        if constexpr (needs::sobol) {
            const auto x = sequence.digits(index, purpose);
            const Words key = mixed(Words{pixel, path, purpose, seed});
            return {uniform<Real>(reversed(scrambled(x[0], key[0]))), uniform<Real>(reversed(scrambled(x[1], key[1])))};
        }
        return {};
    }
};
