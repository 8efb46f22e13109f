// VEC-1: a CSG solid against a ray in each lane: the boundaries of its parts sorted in all lanes at once.
#pragma once
#include "../shapes/csg.hpp"
#include "shapes.hpp"

// What a lane's ray hits: t, not greater than 0 for a miss; of that boundary the part, its face and whether it leaves.
template<typename Real>
struct LaneBoundary {
    Lanes<Real> t{};
    Integers<Real> part{}, face{};
    Mask<Real> leaves{};
};

template<typename Real>
class LaneSolid {
    using L = Lanes<Real>;
    using I = Integers<Real>;
    using V = Vec3<L>;

public:
    explicit LaneSolid(const Solid<Real>& solid) : solid(&solid) {}

    // CSG-1 to CSG-5. Lanes for whose answer two faces may be in one place (CSG-4) are `unsure`: they must be asked by
    // themselves, as all must of a solid that does not fit in lanes.
    LANE LaneBoundary<Real> nearest(const LaneProbe<Real>& probe, unsigned& unsure) const
    {
        const auto& operands = solid->operands;
        const int parts = int(operands.size()), count = 2 * parts;
        L t[2 * most_parts], d_n[2 * most_parts];
        I face[2 * most_parts];  // and 16 times the part
        L size[most_parts];
        for (int p = 0; p < parts; p++)
            cross(operands[std::size_t(p)], p, probe, t + 2 * p, d_n + 2 * p, face + 2 * p, size[p]);
        sort(count, t, d_n, face);

        const V& o = probe.origin;
        const L from = most<Real>(most<Real>(::size<Real>(o.x), ::size<Real>(o.y)), ::size<Real>(o.z));
        const Real sliver = 2 * solid->sliver;  // as d_n is worked out in another way
        Mask<Real> inside[most_parts] = {};
        Mask<Real> value = evaluate(inside), found{}, doubt{};
        L last_t = all(-nowhere), last_d_n = all(Real(1)), last_place{};
        LaneBoundary<Real> hit;
        for (int i = 0; i < count; i++) {
            const Mask<Real> there = t[i] < nowhere;
            if (!any<Real>(there))
                break;
            const I part = face[i] >> 4;
            L reach{};
            for (int p = 0; p < parts; p++) {
                const Mask<Real> mine = there & (part == Integer<Real>(p));
                inside[p] ^= mine;
                reach = mine ? size[p] : reach;
            }
            const Mask<Real> now = evaluate(inside), changes = there & (now ^ value);
            value = there ? now : value;
            if (!any<Real>(changes))
                continue;
            const V at = along<Real>(o, t[i], probe.direction);
            const L place = most<Real>(most<Real>(most<Real>(::size<Real>(at.x), ::size<Real>(at.y)), ::size<Real>(at.z)),
                                       most<Real>(from, reach));
            const L apart = (t[i] - last_t) * least<Real>(last_d_n, d_n[i]);
            doubt |= changes & ~(apart > sliver * most<Real>(place, last_place));
            const Mask<Real> first = changes & ~found & (t[i] > 0);
            hit.t = first ? t[i] : hit.t, hit.part = first ? part : hit.part, hit.face = first ? face[i] & 15 : hit.face;
            hit.leaves = first ? ~now : hit.leaves;
            found |= first;
            last_t = changes ? t[i] : last_t, last_d_n = changes ? d_n[i] : last_d_n;
            last_place = changes ? place : last_place;
        }
        if (methods::merges)
            unsure |= bits<Real>(doubt);
        return hit;
    }

    bool fits() const
    {
        return solid->operands.size() <= std::size_t(most_parts) &&
               std::none_of(solid->operands.begin(), solid->operands.end(),
                            [](const auto& operand) { return operand.kind == Parts<Real>::mesh; });
    }

    const Solid<Real>* solid;

private:
    static constexpr int most_parts = 8;
    static constexpr Real nowhere = std::numeric_limits<Real>::max();  // fast-math believes in no infinity

    // The two boundaries of a part, at `nowhere` if a line does not cross it; |d·n| there, as CSG-4 has it.
    LANE void cross(const typename Solid<Real>::Operand& operand, int p, const LaneProbe<Real>& probe, L* t, L* d_n,
                    I* face, L& size) const
    {
        const Parts<Real>& list = *solid->parts;
        Mask<Real> crossed;
        if (operand.kind == Parts<Real>::box) {
            const Box<Real>& box = list.boxes[operand.row];
            const LaneSpan<Real> span(box, probe);
            crossed = span.in <= span.out;
            t[0] = span.in, t[1] = span.out;
            face[0] = span.face_in, face[1] = span.face_out + 8;
            for (int a = 0; a < 3; a++) {
                const L slope = ::size<Real>(fused_dot<Real>(all(box.normal[a]), probe.direction));
                d_n[0] = (span.face_in >> 1) == Integer<Real>(a) ? slope : d_n[0];
                d_n[1] = (span.face_out >> 1) == Integer<Real>(a) ? slope : d_n[1];
            }
            size = all(box.size);
        } else if (operand.kind == Parts<Real>::sphere) {
            const Sphere<Real>& sphere = list.spheres[operand.row];
            const V f = all(sphere.centre) - probe.origin;
            const L b = fused_dot<Real>(f, probe.direction);
            const V l = along<Real>(f, -b, probe.direction);
            const L delta = sphere.square - fused_dot<Real>(l, l), k = fused_dot<Real>(f, f) - sphere.square;
            crossed = delta >= 0;
            roots(b, k, root<Real>(delta), all(Real(1)), t);
            d_n[0] = d_n[1] = root<Real>(delta) / sphere.radius;
            face[0] = I{}, face[1] = every<Real>(1);
            size = all(sphere.radius);
        } else {
            const Ellipsoid<Real>& ellipsoid = list.ellipsoids[operand.row];
            const LaneUnit<Real> unit(ellipsoid, probe);
            const L k = fused_dot<Real>(unit.f, unit.f) - 1;
            crossed = unit.delta >= 0;
            roots(unit.b, k, root<Real>(unit.a * unit.delta), unit.a, t);
            for (int i = 0; i < 2; i++) {
                const V m = along<Real>(unit.f, t[i], unit.d);
                const V n = along<Real>(along<Real>(scaled<Real>(m.x, all(ellipsoid.g[0])), m.y, all(ellipsoid.g[1])), m.z,
                                        all(ellipsoid.g[2]));
                d_n[i] = ::size<Real>(fused_dot<Real>(n, probe.direction)) * inverse_root<Real>(fused_dot<Real>(n, n));
            }
            face[0] = I{}, face[1] = every<Real>(1);
            size = all(ellipsoid.size);
        }
        for (int i = 0; i < 2; i++)
            t[i] = crossed ? t[i] : all(nowhere), face[i] += Integer<Real>(16 * p);
    }

    // CSG-1, of spheres (a = 1) and ellipsoids
    LANE static void roots(L b, L k, L s, L a, L* t)
    {
        const Mask<Real> ahead = b >= 0;
        const L q = ahead ? b + s : b - s, far = q / a, other = q == 0 ? L{} : k / q;
        t[0] = ahead ? other : far, t[1] = ahead ? far : other;
    }

    // CSG-3: in rising t, of equal t by part and face. Batcher's odd-even merging network (Knuth 5.2.2, algorithm M).
    LANE static void sort(int count, L* t, L* d_n, I* face)
    {
        const auto exchange = [&](int i, int j) {
            const Mask<Real> turned = (t[j] < t[i]) | ((t[j] == t[i]) & (face[j] < face[i]));
            if (!any<Real>(turned))
                return;
            const L a = t[i], b = d_n[i];
            const I c = face[i];
            t[i] = turned ? t[j] : a, t[j] = turned ? a : t[j];
            d_n[i] = turned ? d_n[j] : b, d_n[j] = turned ? b : d_n[j];
            face[i] = turned ? face[j] : c, face[j] = turned ? c : face[j];
        };
        for (int p = 1; p < count; p *= 2)
            for (int k = p; k >= 1; k /= 2)
                for (int j = k % p; j + k < count; j += 2 * k)
                    for (int i = 0; i < k && i + j + k < count; i++)
                        if ((i + j) / (2 * p) == (i + j + k) / (2 * p))
                            exchange(i + j, i + j + k);
    }

    LANE Mask<Real> evaluate(const Mask<Real>* inside) const
    {
        Mask<Real> values[most_parts];
        int part = 0, top = 0;
        for (const int step : solid->steps) {
            if (step < Solid<Real>::op_or)
                values[top++] = inside[part++];
            else if (step == Solid<Real>::op_not)
                values[top - 1] = ~values[top - 1];
            else {
                top--;
                values[top - 1] =
                    step == Solid<Real>::op_or ? values[top - 1] | values[top] : values[top - 1] & values[top];
            }
        }
        return values[0];
    }
};
