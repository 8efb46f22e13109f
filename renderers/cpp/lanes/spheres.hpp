// VEC-1: spheres in lanes: which of them each of several rays meets first, and whether one is in the way to a light.
#pragma once
#include "shapes.hpp"
#include "../shapes/sphere.hpp"

#include <vector>

// Of eye rays: all lie in a cone (VEC-2).
struct Cone {
    Vec3<double> apex, axis;
    double cosine, sine;  // of half its angle

    // May a ray of the cone meet the sphere? A cone of 90 degrees and more holds what lies ahead and more: so yes.
    bool meets(Vec3<double> centre, double radius) const
    {
        constexpr double slack = 1e-5;  // more than float32 can lose of a direction or a distance

        if (!(cosine > 0))
            return true;
        const Vec3<double> f = centre - apex;
        const double ahead = dot(f, axis), beside = length(f - ahead * axis);
        return !(beside * cosine - ahead * sine > radius + slack * (length(f) + radius));
    }
};

// What a ray needs to know of a sphere to meet it.
template<typename Real>
struct LaneSphere {
    Vec3<Real> centre;
    Real radius, square;
    Real least_b;  // of a ray that meets it: 0, or less than -radius if a ray can start inside
    Integer<Real> face;

    // entered: a ray can start inside.
    LaneSphere(const Sphere<Real>& sphere, bool entered, Integer<Real> face)
        : centre(sphere.centre), radius(sphere.radius), square(sphere.square),
          least_b(entered ? -(1 + 32 * std::numeric_limits<Real>::epsilon()) * radius : 0), face(face)
    {
    }
};

// The nearest yet. face: of the surface (scene.hpp), or -1.
template<typename Real>
struct LaneHit {
    Lanes<Real> t = all(std::numeric_limits<Real>::infinity());
    Integers<Real> face = every<Real>(-1);

    LANE void take(Lanes<Real> other, Integers<Real> number)
    {
        const Mask<Real> nearer = (other > 0) & (other < t);
        t = nearer ? other : t;
        face = nearer ? number : face;
    }
};

template<typename Real>
class LaneSpheres {
public:
    std::vector<LaneSphere<Real>> list;

    // HIT-1, HIT-2, SPH-1 with f and l of the other sign: of equal t the first in the list.
    LANE void nearest(const LaneProbe<Real>& probe, LaneHit<Real>& hit) const
    {
        for (const LaneSphere<Real>& sphere : list) {
            const Line line(sphere, probe.origin, probe.direction);
            if (!line.is_near(sphere) || !any<Real>(line.b - sphere.radius < hit.t)) [[likely]]
                continue;
            hit.take(line.meets(sphere), every<Real>(sphere.face));
        }
    }

    // HIT-5, of the lanes that ask.
    LANE void block(Mask<Real> asks, const LaneProbe<Real>& probe, Lanes<Real> distance, Mask<Real>& found) const
    {
        for (const LaneSphere<Real>& sphere : list) {
            const Line line(sphere, probe.origin, probe.direction);
            if (!line.is_near(sphere) || !any<Real>((line.delta >= 0) & asks & ~found)) [[likely]]
                continue;
            const Lanes<Real> t = line.meets(sphere);
            found |= (t > 0) & (t < distance);
            if (!any<Real>(asks & ~found))
                return;
        }
    }

private:

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
