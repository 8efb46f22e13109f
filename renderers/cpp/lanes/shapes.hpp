// VEC-1: boxes, polygons, ellipsoids and triangles against a ray in each lane.
#pragma once
#include "../shapes/box.hpp"
#include "../shapes/ellipsoid.hpp"
#include "lanes.hpp"
#include "../shapes/mesh.hpp"
#include "../shapes/polygon.hpp"

// Rays side by side, and what is worked out once for all shapes.
template<typename Real>
struct LaneProbe {
    using L = Lanes<Real>;

    Vec3<L> origin, direction;

    LANE LaneProbe(const Vec3<L>& origin, const Vec3<L>& direction) : origin(origin), direction(direction) {}

    // Of one lane.
    Ray<Real> ray(int k) const
    {
        return {{origin.x[k], origin.y[k], origin.z[k]}, {direction.x[k], direction.y[k], direction.z[k]}};
    }
};

// Each shape has meet(shape, probe, most): the t of its first hit in each lane, not greater than 0 or NaN for a miss.
// What is not before `most` need not be found.

// BOX-1: where lines go in and out, through sides 2 axis + high. in <= out does not hold where one misses.
template<typename Real>
struct LaneSpan {
    Lanes<Real> in, out;
    Integers<Real> face_in, face_out;

    LANE LaneSpan(const Box<Real>& box, const LaneProbe<Real>& probe)
    {
        using L = Lanes<Real>;
        constexpr Real most = std::numeric_limits<Real>::max();  // fast-math believes in no infinity
        const Vec3<L> f = probe.origin - all(box.corner);
        in = all(-most), out = all(most), face_in = face_out = Integers<Real>{};
        for (int a = 0; a < 3; a++) {
            const Vec3<L> g = all(box.g[a]);
            const L s = fused_dot<Real>(g, f), w = fused_dot<Real>(g, probe.direction), inverse = 1 / w;
            const Mask<Real> down = w < 0, still = w == 0, within = (s >= 0) & (s <= 1);
            const L low = -s * inverse, high = (1 - s) * inverse;
            L near = down ? high : low, far = down ? low : high;
            if (any<Real>(still)) {
                near = still ? (within ? all(-most) : all(most)) : near;
                far = still ? (within ? all(most) : all(-most)) : far;
            }
            const Integers<Real> side = every<Real>(2 * a) - down;
            const Mask<Real> enters = near > in, leaves = far < out;
            in = enters ? near : in, face_in = enters ? side : face_in;
            out = leaves ? far : out, face_out = leaves ? (side ^ 1) : face_out;
        }
    }
};

template<typename Real>
LANE Lanes<Real> meet(const Box<Real>& box, const LaneProbe<Real>& probe, Lanes<Real>)
{
    const LaneSpan<Real> span(box, probe);
    const Lanes<Real> t = span.in > 0 ? span.in : span.out;
    return span.in <= span.out ? t : Lanes<Real>{};
}

// ELL-1
template<typename Real>
struct LaneUnit {
    Vec3<Lanes<Real>> f, d;  // the ray, mapped to where the ellipsoid is the unit sphere
    Lanes<Real> a, b, delta;

    LANE LaneUnit(const Ellipsoid<Real>& ellipsoid, const LaneProbe<Real>& probe)
    {
        const Vec3<Lanes<Real>> from = probe.origin - all(ellipsoid.centre);
        const Vec3<Lanes<Real>> g[3] = {all(ellipsoid.g[0]), all(ellipsoid.g[1]), all(ellipsoid.g[2])};
        f = {fused_dot<Real>(g[0], from), fused_dot<Real>(g[1], from), fused_dot<Real>(g[2], from)};
        d = {fused_dot<Real>(g[0], probe.direction), fused_dot<Real>(g[1], probe.direction),
             fused_dot<Real>(g[2], probe.direction)};
        a = fused_dot<Real>(d, d), b = -fused_dot<Real>(f, d);
        const Vec3<Lanes<Real>> l = along<Real>(f, b / a, d);
        delta = 1 - fused_dot<Real>(l, l);
    }
};

template<typename Real>
LANE Lanes<Real> meet(const Ellipsoid<Real>& ellipsoid, const LaneProbe<Real>& probe, Lanes<Real>)
{
    using L = Lanes<Real>;
    const LaneUnit<Real> unit(ellipsoid, probe);
    const Mask<Real> near = unit.delta >= 0;
    if (!any<Real>(near))
        return L{};
    const L k = fused_dot<Real>(unit.f, unit.f) - 1, s = root<Real>(unit.a * unit.delta), b = unit.b;
    const Mask<Real> inside = ~(k > 0), ahead = b >= 0;
    const L t = inside & ahead ? (b + s) / unit.a : k / (inside ? b - s : b + s);
    return near & (inside | (b > 0)) ? t : L{};
}

// TRI-1: the frame of each ray, by masks of its axis; and a point in it.
template<typename Real>
struct LaneShear {
    using L = Lanes<Real>;

    Mask<Real> along_x, along_y, swapped;
    Vec3<L> start;
    L sx, sy, sz;

    LANE explicit LaneShear(const LaneProbe<Real>& probe)
    {
        const Vec3<L>& d = probe.direction;
        const L x = size<Real>(d.x), y = size<Real>(d.y), z = size<Real>(d.z);
        along_y = (y > x) & ~(z > y), along_x = ~(y > x) & ~(z > x);
        const Vec3<L> e = turned(d);
        swapped = e.z < 0;
        start = probe.origin;
        sz = 1 / e.z;
        const L p = e.x / e.z, q = e.y / e.z;
        sx = swapped ? q : p, sy = swapped ? p : q;
    }

    // The axis of the ray last.
    LANE Vec3<L> turned(const Vec3<L>& a) const
    {
        return {along_x ? a.y : along_y ? a.z : a.x, along_x ? a.z : along_y ? a.x : a.y,
                along_x ? a.x : along_y ? a.y : a.z};
    }

    // Products are not fused: U of one triangle must be that of its neighbour with the other sign.
    LANE Vec3<L> operator()(const Real (&vertex)[3]) const
    {
        const Vec3<L> a = turned(all(Vec3<Real>{vertex[0], vertex[1], vertex[2]}) - start);
        const L x = swapped ? a.y : a.x, y = swapped ? a.x : a.y;
        return {x - sx * a.z, y - sy * a.z, a.z};
    }
};

// POL-1, POL-2.
template<typename Real>
LANE Lanes<Real> meet(const Polygon<Real>& polygon, const LaneProbe<Real>& probe, const LaneShear<Real>& shear,
                      Lanes<Real> most)
{
    using L = Lanes<Real>;
    const auto edge = [](const Vec3<L>& a, const Vec3<L>& b) -> L { return a.x * b.y - a.y * b.x; };
    const Vec3<L> n = all(polygon.normal), vertex = all(polygon.corners[0].point());
    const L slope = fused_dot<Real>(probe.direction, n), height = fused_dot<Real>(vertex - probe.origin, n);
    L t = height / slope;
    const Mask<Real> grazes = (size<Real>(slope) < Polygon<Real>::grazing) & (slope != 0);
    Mask<Real> met = ((t > 0) & (t < most)) | grazes;
    if (!any<Real>(met))
        return L{};
    const Vec3<L> a = shear(polygon.corners[0].place);
    Vec3<L> b = shear(polygon.corners[1].place);
    L w = edge(a, b);
    Mask<Real> inside{};
    for (std::size_t i = 2; i < polygon.corners.size(); i++) {
        const Vec3<L> c = shear(polygon.corners[i].place);
        const L u = edge(b, c), v = edge(c, a), sum = u + v + w;
        const Mask<Real> crossed =
            (((u >= 0) & (v >= 0) & (w >= 0)) | ((u <= 0) & (v <= 0) & (w <= 0))) & (sum != 0);
        if (any<Real>(crossed & grazes)) {
            const L crossing = (u * (shear.sz * a.z) + v * (shear.sz * b.z) + w * (shear.sz * c.z)) / sum;
            t = crossed & grazes ? crossing : t;
        }
        inside |= crossed;
        w = -v, b = c;
    }
    met &= inside;
    if (!any<Real>(met))
        return L{};
    const auto absolute = [](const Vec3<L>& v) -> Vec3<L> { return {size<Real>(v.x), size<Real>(v.y), size<Real>(v.z)}; };
    const L rounding = Polygon<Real>::rounding * fused_dot<Real>(absolute(n), absolute(vertex) + absolute(probe.origin));
    return met & (size<Real>(height) > rounding) ? t : L{};
}

template<typename Real>
LANE Lanes<Real> meet(const Triangle<Real>& triangle, const LaneShear<Real>& shear, Lanes<Real>)
{
    using L = Lanes<Real>;
    const Vec3<L> a = shear(triangle.vertex[0]), b = shear(triangle.vertex[1]), c = shear(triangle.vertex[2]);
    const L u = c.x * b.y - c.y * b.x, v = a.x * c.y - a.y * c.x, w = b.x * a.y - b.y * a.x, sum = u + v + w;
    const Mask<Real> met = (((u >= 0) & (v >= 0) & (w >= 0)) | ((u <= 0) & (v <= 0) & (w <= 0))) & (sum != 0);
    if (!any<Real>(met))
        return L{};
    const L t = (u * (shear.sz * a.z) + v * (shear.sz * b.z) + w * (shear.sz * c.z)) / sum;
    return met ? t : L{};
}
