// VEC-1: random numbers and points of sequences in lanes.
#pragma once
#include "lanes.hpp"
#include "../random.hpp"

namespace lane_random {

// Words of 32 bits in lanes of 64; what is above them is rubbish.
using Word = std::uint64_t;
using Words = Side<Word>::By;

// Of the words, all 64 bits.
LANE Words product(Words a, std::uint32_t b)
{
#ifdef WIDE_LANES
    return Words(_mm512_maskz_mul_epu32(__mmask8(-1), __m512i(a), __m512i(Words{} + Word(b))));
#elif defined(__AVX2__)
    return Words(_mm256_mul_epu32(__m256i(a), __m256i(Words{} + Word(b))));
#else
    return (a & 0xffffffffu) * b;
#endif
}

// RND-1
LANE void philox(Words (&c)[4], std::uint32_t k0, std::uint32_t k1)
{
#pragma GCC unroll 10
    for (int round = 0; round < 10; round++) {
        const Words p0 = product(c[0], 0xD2511F53), p1 = product(c[2], 0xCD9E8D57);
        c[0] = (p1 >> 32) ^ c[1] ^ k0, c[1] = p1;
        c[2] = (p0 >> 32) ^ c[3] ^ k1, c[3] = p0;
        k0 += 0x9E3779B9;
        k1 += 0xBB67AE85;
    }
}

}  // namespace lane_random

// RND-2, RND-3: the numbers for one use, of lanes with a pixel and a path each.
template<typename Real>
LANE void draw(Integers<Real> pixel, std::uint32_t sample, Integers<Real> path, std::uint32_t use, std::uint32_t seed,
               Lanes<Real> (&u)[4])
{
    using lane_random::Words;
    using Half [[gnu::vector_size(lane_bytes / 2)]] = std::int32_t;
    constexpr int parts = sizeof(Words) / sizeof(std::uint64_t) < lane_count<Real> ? 2 : 1;

    Integers<Real> words[4];
    for (int part = 0; part < parts; part++) {
        Words pixels, paths;
        if constexpr (parts == 1)
            pixels = Words(pixel), paths = Words(path);
        else {
            Half some[2];
            __builtin_memcpy(&some[0], reinterpret_cast<const char*>(&pixel) + part * sizeof(Half), sizeof(Half));
            __builtin_memcpy(&some[1], reinterpret_cast<const char*>(&path) + part * sizeof(Half), sizeof(Half));
            pixels = __builtin_convertvector(some[0], Words), paths = __builtin_convertvector(some[1], Words);
        }
        Words c[4] = {pixels, Words{} + sample, paths, Words{} + use};
        lane_random::philox(c, seed, 0);
        for (int i = 0; i < 4; i++) {
            const Words word = (c[i] & 0xffffffffu) >> 8;
            if constexpr (parts == 1)
                words[i] = Integers<Real>(word);
            else {
                const Half some = __builtin_convertvector(word, Half);
                __builtin_memcpy(reinterpret_cast<char*>(&words[i]) + part * sizeof(Half), &some, sizeof(Half));
            }
        }
    }
    for (int i = 0; i < 4; i++)
        u[i] = __builtin_convertvector(words[i], Lanes<Real>) * Real(0x1p-24);
}

// Words of 32 bits, as many as there are lanes.
template<typename Real>
struct LaneWord {
    using By [[gnu::vector_size(4 * lane_count<Real>)]] = std::uint32_t;
};

// SOB-1: a point for lanes with a pixel and a path each.
template<typename Real>
LANE void draw_point(Integers<Real> pixel, Integers<Real> path, std::uint32_t purpose, std::uint32_t index,
                     std::uint32_t seed, const Sequence& sequence, Lanes<Real>& u0, Lanes<Real>& u1)
{
    using Word = typename LaneWord<Real>::By;
    const std::array<std::uint32_t, 2> x = sequence.digits(index, purpose);
    const std::array<Word, 4> key = mixed<Word>({__builtin_convertvector(pixel, Word), __builtin_convertvector(path, Word),
                                                 Word{} + purpose, Word{} + seed});
    const Word words[2] = {reversed<Word>(scrambled<Word>(Word{} + x[0], key[0])),
                           reversed<Word>(scrambled<Word>(Word{} + x[1], key[1]))};
    u0 = __builtin_convertvector(__builtin_convertvector(words[0] >> 8, Integers<Real>), Lanes<Real>) * Real(0x1p-24);
    u1 = __builtin_convertvector(__builtin_convertvector(words[1] >> 8, Integers<Real>), Lanes<Real>) * Real(0x1p-24);
}
