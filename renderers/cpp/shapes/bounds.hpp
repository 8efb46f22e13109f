#pragma once
#include "../vector.hpp"

#include <limits>

// A box along the axes that holds a shape. Empty at first.
template<typename Real>
struct Bounds {
    static constexpr Real infinity = std::numeric_limits<Real>::infinity();
    Vec3<Real> low{infinity, infinity, infinity}, high{-infinity, -infinity, -infinity};

    void hold(Vec3<Real> p) { hold(Bounds{p, p}); }

    void hold(const Bounds& other)  // which may be empty
    {
        const Vec3<Real>&l = other.low, &h = other.high;
        low = {std::min(low.x, l.x), std::min(low.y, l.y), std::min(low.z, l.z)};
        high = {std::max(high.x, h.x), std::max(high.y, h.y), std::max(high.z, h.z)};
    }

    bool empty() const { return !(low.x <= high.x && low.y <= high.y && low.z <= high.z); }
    Real area() const  // half of it, which is as good to compare
    {
        const Vec3<Real> d = high - low;
        return empty() ? 0 : d.x * d.y + d.y * d.z + d.z * d.x;
    }

    // With `error` units in the last place, of the largest coordinate, to all sides.
    Bounds padded(Real error) const
    {
        const Real pad = error * std::numeric_limits<Real>::epsilon() * std::max(largest(low), largest(high));
        return {low - Vec3<Real>{pad, pad, pad}, high + Vec3<Real>{pad, pad, pad}};
    }
};

// A centre, and how far it goes to both sides along each axis.
template<typename Real>
Bounds<Real> around(Vec3<Real> centre, Vec3<Real> reach)
{
    return {centre - reach, centre + reach};
}

template<typename Real>
Bounds<Real> common(const Bounds<Real>& a, const Bounds<Real>& b)
{
    return {{std::max(a.low.x, b.low.x), std::max(a.low.y, b.low.y), std::max(a.low.z, b.low.z)},
            {std::min(a.high.x, b.high.x), std::min(a.high.y, b.high.y), std::min(a.high.z, b.high.z)}};
}
