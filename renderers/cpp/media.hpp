// Which medium a ray is in (MED-1 to MED-5).
#pragma once
#include "needs.hpp"
#include "shapes/scene.hpp"
#include "shade.hpp"

#include <bit>

// MED-2: the clear solids with a rank that a ray is in, one bit each; the highest bit ranks highest.
using Solids = std::uint64_t;
using Inside = Only<needs::media, Solids, 'm'>;

template<typename Real>
struct Medium {
    double n, mu;
    Vec3<Real> attenuation;
    bool attenuates;  // ATT-1: else A is 1

    Medium(double eps, double mu, Vec3<double> a)
        : n(std::sqrt(eps * mu)), mu(mu), attenuation(rounded<Real>(a)),
          attenuates((a.x != 0 || a.y != 0 || a.z != 0) && (a.x != 1 || a.y != 1 || a.z != 1))
    {
    }

    bool operator==(const Medium& other) const
    {
        const Vec3<Real>&a = attenuation, &b = other.attenuation;
        return n == other.n && mu == other.mu && attenuates == other.attenuates && a.x == b.x && a.y == b.y && a.z == b.z;
    }
};

// MED-3, MED-4: the two sides of a surface that a ray meets: where it is, and where it would get to.
struct Sides {
    int i, t;  // media
    [[no_unique_address]] Inside was;
    [[no_unique_address]] Only<needs::media, Solids, 'b'> beyond;
};

template<typename Real>
class Media {
public:
    explicit Media(const Scene& scene)
    {
        const double* air = scene.air.data.data();
        of_material.emplace_back(air[0], air[1], vec(air + 2));
        for (std::size_t i = 0; i < scene.materials.rows(); i++) {
            const double* row = scene.materials.row(i);
            of_material.emplace_back(row[8], row[9], vec(row + 5));
        }
        for (std::size_t i = 0; i < scene.media.rows(); i++) {
            ranked.push_back(scene.media.row(i)[1] + 1);
            eye |= Solids(scene.media.row(i)[2] != 0) << i;
        }
    }

    Inside at_eye() const { return eye; }
    const std::vector<int>& by_rank() const { return ranked; }

    template<typename Set>  // Inside; a template, so that only one of the two ways is compiled
    Sides sides(const Set& inside, int material, int rank, bool enters) const
    {
        if constexpr (needs::media) {
            if (rank >= 0) {
                const Solids solid = Solids(1) << rank, without = inside & ~solid, with = inside | solid;
                const int outer = medium(without), inner = medium(with);
                return enters ? Sides{outer, inner, without, with} : Sides{inner, outer, with, without};
            }
            const int outer = medium(inside), inner = material + 1;
            return enters ? Sides{outer, inner, inside, inside} : Sides{inner, outer, inside, inside};
        } else
            return enters ? Sides{0, material + 1, {}, {}} : Sides{material + 1, 0, {}, {}};
    }

    Interface<Real> between(const Sides& sides) const
    {
        const Medium<Real>&i = (*this)[sides.i], &t = (*this)[sides.t];
        return {Real(i.n / t.n), Real(i.mu / t.mu)};  // rounded once, as those of a Material
    }

    const Medium<Real>& operator[](int medium) const { return of_material[std::size_t(medium)]; }

    // MED-2: of a set.
    int medium(Solids inside) const { return inside ? ranked[std::size_t(std::bit_width(inside) - 1)] : 0; }

private:
    std::vector<Medium<Real>> of_material;  // that of the material in row i is number i + 1; AIR is 0
    std::vector<int> ranked;
    Solids eye = 0;
};
