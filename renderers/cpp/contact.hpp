// Surfaces in one place, and the media that they part (MED-6 to MED-8).
#pragma once
#include "media.hpp"
#include "shapes/shapes.hpp"

// Where a ray ends: what is there of all the surfaces that it crosses there (MED-7).
template<typename Real>
struct Place {
    Surface<Real> at;  // size: the largest of all
    int shape;
    Sides sides;
    bool none;  // there is no surface (MED-8)
};

template<typename Real>
class Contact {
public:
    Contact(const Scene& scene, const Shapes<Real>& shapes, const Media<Real>& media, Real epsilon)
        : shapes(shapes), media(media), epsilon(epsilon)
    {
        if (scene.precedence.data.empty())
            return;
        for (const Role& role : shapes.roles) {
            precedence.push_back(scene.precedence.data[std::size_t(role.object)]);
            extents.push_back(shapes.extent(int(extents.size())));
        }
        largest = *std::max_element(extents.begin(), extents.end());
    }

    bool possible() const { return methods::merges && !precedence.empty(); }

    // LOC-2: how far what stops a feeler to a light may be, which is less far than what the light lies on.
    Real reach(Real distance, const Ray<Real>& feeler) const
    {
        Real room = 0;
        if constexpr (methods::offset == Offset::fixed)
            room = epsilon;
        else if constexpr (methods::offset != Offset::none)
            room = epsilon * (largest + ::largest(feeler.origin + distance * feeler.direction));
        return distance - 512 * room;
    }

    // MED-6: of a ray in the set `inside` that hits a shape at `at`. to_probe(ray) is what its tests take.
    template<typename ToProbe>
    [[gnu::noinline]] Place<Real> meet(Solids inside, const Vec3<Real>& direction, const Surface<Real>& at, int shape,
                                       const ToProbe& to_probe) const
    {
        const Real slope = std::abs(dot(direction, at.normal)), steep = std::max(slope, grazing);
        Solids changes[2] = {};  // entered, left
        const auto cross = [&](int number, const Surface<Real>& there) {
            const int rank = shapes.roles[std::size_t(number)].rank;
            if (rank >= 0)
                changes[dot(direction, there.normal) > 0] |= Solids(1) << rank;
        };
        const auto reach_of = [&](Real size) {
            return Surface<Real>{at.point, at.normal, std::max(size, at.size)}.distance(epsilon);
        };
        Place<Real> place{at, shape, {}, false};
        Real size = at.size;
        cross(shape, at);
        shapes.around(at.point, 8 * reach_of(largest) / steep, [&](int number) {
            if (shapes.roles[std::size_t(number)].object == shapes.roles[std::size_t(shape)].object)
                return;
            const Real reach = reach_of(extents[std::size_t(number)]), back = 8 * reach / steep;
            const auto probe = to_probe(Ray<Real>{at.point - back * direction, direction});
            const Real t = shapes.distance(number, probe);
            if (!(t > 0 && t < 2 * back))
                return;
            const Surface<Real> there = shapes.surface(probe, {t, number});
            if (!(std::abs(t - back) * std::max(slope, std::abs(dot(direction, there.normal))) <= reach))
                return;
            size = std::max(size, there.size);
            cross(number, there);
            if (precedence[std::size_t(number)] > precedence[std::size_t(place.shape)])
                place.at = there, place.shape = number;
        });
        place.at.size = size;
        media_of(inside, changes[0] & ~changes[1], changes[1] & ~changes[0], direction, place);
        return place;
    }

private:
    static constexpr Real grazing = Real(1) / 1024;  // least |d·n| that the way back to a start is worked out with

    const Shapes<Real>& shapes;
    const Media<Real>& media;
    Real epsilon, largest = 0;
    std::vector<int> precedence;  // by shape, as `extents`
    std::vector<Real> extents;

    // MED-7, MED-8
    void media_of(Solids inside, Solids entered, Solids left, const Vec3<Real>& direction, Place<Real>& place) const
    {
        const Role& role = shapes.roles[std::size_t(place.shape)];
        const Solids was = (inside | left) & ~entered, beyond = (inside | entered) & ~left;
        const int i = media.medium(was), t = media.medium(beyond), own = role.material + 1;
        if (role.rank >= 0) {
            place.sides = {i, t, was, beyond};
            place.none = ((entered | left) & ~(Solids(1) << role.rank)) != 0 && media[i] == media[t];
        } else if (!role.flat && dot(direction, place.at.normal) > 0)
            place.sides = {own, i, was, beyond};
        else
            place.sides = {i, own, was, beyond};
    }
};
