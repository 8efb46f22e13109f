// VEC-1: spheres in lanes: which of them each of several rays meets first, and whether one is in the way to a light.
#pragma once
#include "lanes.hpp"
#include "scene.hpp"

#include <vector>

// Of eye rays: all lie in a cone (VEC-2).
struct Cone {
    Vec3<double> apex, axis;
    double cosine, sine;  // of half its angle

    // May a ray of the cone meet the sphere? A cone of 90 degrees and more holds what lies ahead and more: so yes.
    bool meets(Vec3<double> centre, double radius) const
    {
        constexpr double slack = 1e-5;  // more than float32 can lose of a direction or a distance

        const Vec3<double> f = centre - apex;
        const double ahead = dot(f, axis), beside = length(f - ahead * axis);
        return !(cosine > 0 && beside * cosine - ahead * sine > radius + slack * (length(f) + radius));
    }
};

// What a ray needs to know of a sphere to meet it.
template<typename Real>
struct LaneSphere {
    Vec3<Real> centre;
    Real radius, square, number;
    Real least_b;  // of a ray that meets it: 0, or less than -radius if a ray can start inside
};

template<typename Real>
struct LaneHit {
    Lanes<Real> t = all(std::numeric_limits<Real>::infinity()), sphere = all(Real(-1));
};

template<typename Real>
class LaneSpheres {
public:
    LaneSpheres() = default;

    // eye: where rays start that leave no sphere. epsilon: of OFF-1.
    LaneSpheres(const Scene& scene, Vec3<double> eye, double epsilon)
    {
        for (std::size_t i = 0; i < scene.spheres.rows(); i++) {
            const double* row = scene.spheres.row(i);
            const Real radius = Real(row[3]);
            const bool entered = may_be_entered(scene, i, eye, epsilon);
            const Real least_b = entered ? -(1 + 32 * std::numeric_limits<Real>::epsilon()) * radius : 0;
            list.push_back({rounded<Real>(vec(row)), radius, radius * radius, Real(i), least_b});
        }
    }

    // Those that a ray of the cone may meet.
    void keep(const LaneSpheres& all, const Cone& cone)
    {
        list.clear();
        for (const LaneSphere<Real>& sphere : all.list)
            if (cone.meets({double(sphere.centre.x), double(sphere.centre.y), double(sphere.centre.z)}, sphere.radius))
                list.push_back(sphere);
    }

    // HIT-1, HIT-2, SPH-1 with f and l of the other sign: of equal t the first in the list.
    LaneHit<Real> nearest(const Vec3<Lanes<Real>>& origin, const Vec3<Lanes<Real>>& direction) const
    {
        LaneHit<Real> hit;
        for (const LaneSphere<Real>& sphere : list) {
            const Line line(sphere, origin, direction);
            if (!line.is_near(sphere) || !any<Real>(line.b - sphere.radius < hit.t)) [[likely]]
                continue;
            const Lanes<Real> t = line.meets(sphere);
            const Mask<Real> nearer = (t > 0) & (t < hit.t);
            hit.t = nearer ? t : hit.t;
            hit.sphere = nearer ? all(sphere.number) : hit.sphere;
        }
        return hit;
    }

    // HIT-5, of the lanes that ask.
    Mask<Real> blocked(Mask<Real> asks, const Vec3<Lanes<Real>>& origin, const Vec3<Lanes<Real>>& direction,
                       Lanes<Real> distance) const
    {
        Mask<Real> found{};
        for (const LaneSphere<Real>& sphere : list) {
            const Line line(sphere, origin, direction);
            if (!line.is_near(sphere) || !any<Real>((line.delta >= 0) & asks & ~found)) [[likely]]
                continue;
            const Lanes<Real> t = line.meets(sphere);
            found |= (t > 0) & (t < distance);
            if (!any<Real>(asks & ~found))
                break;
        }
        return found & asks;
    }

private:
    std::vector<LaneSphere<Real>> list;

    // Can a ray start inside the sphere? It starts at the eye, or on another sphere and as far from it as OFF-1 says.
    static bool may_be_entered(const Scene& scene, std::size_t number, Vec3<double> eye, double epsilon)
    {
        constexpr double slack = 1e-3;         // of the sizes: more than rounding is
        constexpr std::size_t many = 1 << 12;  // too many to ask for each pair

        const double* mine = scene.spheres.row(number);
        const auto near = [&](Vec3<double> place, double radius) {
            const double offset = epsilon * (radius + length(place));
            return length(place - vec(mine)) < mine[3] + radius + offset + slack * (mine[3] + radius);
        };
        bool entered = scene.spheres.rows() > many || near(eye, 0);
        for (std::size_t i = 0; i < scene.spheres.rows() && !entered; i++)
            entered = i != number && near(vec(scene.spheres.row(i)), scene.spheres.row(i)[3]);
        return entered;
    }

    // A ray's line beside a sphere: b, and the discriminant delta.
    struct Line {
        Vec3<Lanes<Real>> f;
        Lanes<Real> b, delta;

        LANE Line(const LaneSphere<Real>& sphere, const Vec3<Lanes<Real>>& origin, const Vec3<Lanes<Real>>& direction)
            : f{sphere.centre.x - origin.x, sphere.centre.y - origin.y, sphere.centre.z - origin.z},
              b(fused_dot<Real>(f, direction))
        {
            const Vec3<Lanes<Real>> l = along<Real>(f, -b, direction);
            delta = sphere.square - fused_dot<Real>(l, l);
        }

        // Does a lane pass the sphere so closely, and not with the sphere behind?
        LANE bool is_near(const LaneSphere<Real>& sphere) const
        {
            return any_both<Real>(delta, b, sphere.least_b);
        }

        // t, or anything not greater than 0, or NaN.
        LANE Lanes<Real> meets(const LaneSphere<Real>& sphere) const
        {
            const Lanes<Real> k = fused_dot<Real>(f, f) - sphere.square, half = root<Real>(delta);
            const Mask<Real> inside = ~(k > 0), back = b < 0;
            const Lanes<Real> q = inside & back ? b - half : b + half;
            const Lanes<Real> t = inside & ~back ? q : k / q;
            return inside | (b > 0) ? t : Lanes<Real>{};
        }
    };
};
