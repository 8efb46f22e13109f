// VEC-1: media in lanes (MED-1 to MED-5, REF-1, ATT-1).
#pragma once
#include "math.hpp"
#include "../media.hpp"

// What no media need is empty; lanes have one number of 32 or 64 bits for a set of solids.
template<typename Real> using LaneInside = Only<needs::media, Integers<Real>, 'i'>;

template<typename Real>
struct LaneSides {
    Integers<Real> i, t;
    [[no_unique_address]] LaneInside<Real> was;
    [[no_unique_address]] Only<needs::media, Integers<Real>, 'b'> beyond;
};

template<typename Real>
class LaneMedia {
    using L = Lanes<Real>;
    using I = Integers<Real>;

public:
    // materials: how many there are.
    LaneMedia(const Media<Real>& media, std::size_t materials) : media(media)
    {
        for (std::size_t i = 0; i <= materials; i++) {
            const Medium<Real>& medium = media[int(i)];
            std::size_t place = 0;
            while (place < kinds.size() && !(medium == media[kinds[place]]))
                place++;
            if (place == kinds.size()) {
                kinds.push_back(int(i));
                for (const Real a : {medium.attenuation.x, medium.attenuation.y, medium.attenuation.z})
                    logarithms.push_back(medium.attenuates ? Real(std::log2(double(a))) : 0);
            }
            kind_of.push_back(int(place));
        }
        for (const int from : kinds)
            for (const int to : kinds) {
                const Interface<Real> interface = media.between({from, to, {}, {}});
                n.push_back(interface.n), m.push_back(interface.m);
            }
        for (const int medium : media.by_rank())
            ranked.push_back(kind_of[std::size_t(medium)]);
    }

    static bool fits(std::size_t ranks) { return ranks < sizeof(Real) * 8 - 1; }

    // Of a material, as a number for `sides`.
    int kind(int material) const { return kind_of[std::size_t(material) + 1]; }

    LaneInside<Real> at_eye() const
    {
        if constexpr (needs::media)
            return every<Real>(Integer<Real>(media.at_eye()));
        else
            return {};
    }

    // MED-3, MED-4. own: the kind of the material that was hit; rank: of the solid, or -1.
    LANE LaneSides<Real> sides([[maybe_unused]] const LaneInside<Real>& inside, I own, [[maybe_unused]] I rank,
                               Mask<Real> enters) const
    {
        if constexpr (needs::media) {
            const Mask<Real> has_rank = rank >= 0;
            const I solid = has_rank ? every<Real>(1) << (has_rank ? rank : I{}) : I{};
            const I without = inside & ~solid, with = inside | solid;
            const I outer = medium(without), inner = has_rank ? medium(with) : own;
            return {enters ? outer : inner, enters ? inner : outer, enters ? without : with, enters ? with : without};
        } else {
            const I air = every<Real>(kind_of[0]);
            return {enters ? air : own, enters ? own : air, {}, {}};
        }
    }

    LANE void between(const LaneSides<Real>& sides, L& n_of, L& m_of) const
    {
        const I place = sides.i * Integer<Real>(kinds.size()) + sides.t;
        n_of = lanes_of<Real>([&](int k) { return n[std::size_t(place[k])]; });
        m_of = lanes_of<Real>([&](int k) { return m[std::size_t(place[k])]; });
    }

    // ATT-1: a^t = 2^(t log2 a), off by some u.
    LANE Vec3<L> attenuation(I medium, L t) const
    {
        const auto channel = [&](int c) {
            return lane_math::exp2<Real>(
                t * lanes_of<Real>([&](int k) { return logarithms[std::size_t(medium[k]) * 3 + std::size_t(c)]; }));
        };
        return {channel(0), channel(1), channel(2)};
    }

private:
    const Media<Real>& media;
    std::vector<int> kinds, kind_of, ranked;  // kinds: a medium of each kind; kind_of: of all media
    std::vector<Real> logarithms, n, m;

    LANE I medium(I inside) const
    {
        I found = every<Real>(kind_of[0]);
        for (std::size_t rank = 0; rank < ranked.size(); rank++)
            found = (inside >> Integer<Real>(rank) & 1) != 0 ? every<Real>(ranked[rank]) : found;
        return found;
    }
};
