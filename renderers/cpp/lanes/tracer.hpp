// VEC-1: from streams of rays to streams of hits, their light, and streams of the rays that come after them.
#pragma once
#include "random.hpp"
#include "streams.hpp"

template<typename Real>
class LaneTracer {
    using L = Lanes<Real>;
    using I = Integers<Real>;
    using V = Vec3<L>;
    using Unsigned = typename Side<std::make_unsigned_t<Integer<Real>>>::By;

public:
    // eye: where rays start, and as far from there as `lens`. few: each ray is tried against each shape.
    LaneTracer(const Tracer<Real>& tracer, const Job& job, Vec3<double> eye, double lens, bool few)
        : tracer(tracer), media(tracer.media, tracer.materials.size()), scene(tracer, media, eye, lens, few),
          depth(needs::reflection ? tracer.depth : 0), children(int(tracer.path_base())),
          cutoff(job.cutoff > 0 ? Real(job.cutoff) : -1), seed(job.seed)
    {
    }

    const LaneShapes<Real>& shapes() const { return scene.all_shapes; }
    LaneInside<Real> at_eye() const { return media.at_eye(); }

    void make_room(LaneWorker<Real>& worker, int samples) const
    {
        tracer.shapes.make_room(worker.desk.scratch);
        worker.orders.resize(std::size_t(depth) + 1);
        worker.orders[0].rays.make_room(samples);
        for (auto& hits : worker.orders[0].hits)
            hits.make_room(samples);
        for (std::vector<Real>& channel : worker.colours)
            channel.resize(std::size_t(samples));
        if constexpr (needs::cutoff)
            worker.dropped.resize(std::size_t(samples));
        if constexpr (needs::random)
            worker.numbers.resize(std::size_t(samples));
    }

    // The sample's own numbers: of its place in the pixel, and on the lens (RND-3, SOB-1).
    [[gnu::noinline]] void draw_own([[maybe_unused]] I pixel, [[maybe_unused]] const LaneWorker<Real>& worker,
                                    [[maybe_unused]] L (&u)[4]) const
    {
        if constexpr (needs::random) {
            const I number = numbers_of(pixel, worker);
            if constexpr (needs::sobol)
                if (const Sequence& sequence = tracer.sequence; sequence.matrices) {
                    ::draw_point<Real>(number, I{}, Sequence::place, worker.sample, seed, sequence, u[0], u[1]);
                    if (sequence.first > Sequence::lens)
                        ::draw_point<Real>(number, I{}, Sequence::lens, worker.sample, seed, sequence, u[2], u[3]);
                    return;
                }
            ::draw<Real>(number, worker.sample, I{}, 0, seed, u);
        }
    }

    // SOF-2: of feeler f to a light.
    LANE void draw_for_feeler([[maybe_unused]] const LaneBranch<Real>& branch, [[maybe_unused]] std::uint32_t light,
                              [[maybe_unused]] std::uint32_t f, [[maybe_unused]] const LaneWorker<Real>& worker,
                              [[maybe_unused]] L (&u)[4]) const
    {
        const std::uint32_t feelers = std::uint32_t(tracer.feelers);
        if constexpr (needs::sobol)
            if (const std::uint32_t purpose = tracer.sequence.of_light(worker.order, light); tracer.sequence.has(purpose))
                return draw_point(branch, purpose, worker.sample * feelers + f, worker, u);
        draw_random(branch, 1 + light * feelers + f, worker, u);
    }

    // GLO-2: of glossy ray g.
    LANE void draw_for_lobe([[maybe_unused]] const LaneBranch<Real>& branch, [[maybe_unused]] std::uint32_t g,
                            [[maybe_unused]] const LaneWorker<Real>& worker, [[maybe_unused]] L (&u)[4]) const
    {
        if constexpr (needs::sobol)
            if (const std::uint32_t purpose = tracer.sequence.of_lobe(worker.order); tracer.sequence.has(purpose))
                return draw_point(branch, purpose, worker.sample * std::uint32_t(tracer.glossy_rays) + g, worker, u);
        draw_random(branch, 0x80000000 + g, worker, u);
    }

    [[gnu::noinline]] void draw_point([[maybe_unused]] const LaneBranch<Real>& branch,
                                      [[maybe_unused]] std::uint32_t purpose, [[maybe_unused]] std::uint32_t index,
                                      [[maybe_unused]] const LaneWorker<Real>& worker, [[maybe_unused]] L (&u)[4]) const
    {
        if constexpr (needs::sobol)
            ::draw_point<Real>(numbers_of(branch.pixel, worker), branch.path, purpose, index, seed, tracer.sequence,
                               u[0], u[1]);
    }

    [[gnu::noinline]] void draw_random([[maybe_unused]] const LaneBranch<Real>& branch, [[maybe_unused]] std::uint32_t use,
                                       [[maybe_unused]] const LaneWorker<Real>& worker, [[maybe_unused]] L (&u)[4]) const
    {
        if constexpr (needs::random)
            ::draw<Real>(numbers_of(branch.pixel, worker), worker.sample, branch.path, use, seed, u);
    }

    LANE I numbers_of([[maybe_unused]] I pixel, [[maybe_unused]] const LaneWorker<Real>& worker) const
    {
        I number{};
        if constexpr (needs::random)
            for (int k = 0; k < lane_count<Real>; k++)
                number[k] = Integer<Real>(worker.numbers[std::size_t(pixel[k])]);
        return number;
    }

    // The first hits of some rays, into the streams of their order; what misses has the background (REF-6).
    [[gnu::noinline]] void meet(const LaneShapes<Real>& among, Mask<Real> active, const LaneRay<Real>& ray, int order,
                   LaneWorker<Real>& worker) const
    {
        const LaneProbe<Real> probe(ray.origin, ray.direction);
        const LaneHit<Real> hit = scene.nearest(among, active, probe, worker.desk);
        const Mask<Real> hits = active & (hit.face >= 0);
        if (any<Real>(hits)) {
            const LaneRayHit<Real> record{along<Real>(ray.origin, hit.t, ray.direction), ray.direction, hit.face, hit.t,
                                          ray.branch};
            add_form<form_sphere, needs::sphere || needs::csg>(hits, record, order, worker);
            add_form<form_plane, needs::box || needs::polygon || needs::mesh || needs::csg>(hits, record, order, worker);
            add_form<form_ellipsoid, needs::ellipsoid || needs::csg>(hits, record, order, worker);
        }
        const Vec3<Real>& background = tracer.background;
        if (background.x != 0 || background.y != 0 || background.z != 0)
            add_colours(active & ~hits, ray.branch, all(background), worker);
    }

    // The light of the hits of an order, and of all the rays that come after them.
    void follow(int order, LaneWorker<Real>& worker) const
    {
        LaneOrder<Real>& here = worker.orders[std::size_t(order)];
        follow_form<form_sphere, needs::sphere || needs::csg>(here, order, worker);
        follow_form<form_plane, needs::box || needs::polygon || needs::mesh || needs::csg>(here, order, worker);
        follow_form<form_ellipsoid, needs::ellipsoid || needs::csg>(here, order, worker);
        follow_rays(order + 1, worker);
    }

private:
    const Tracer<Real>& tracer;
    LaneMedia<Real> media;
    LaneScene<Real> scene;
    int depth, children;
    Real cutoff;
    std::uint32_t seed;

    template<Form form, bool possible>
    LANE static void add_form(Mask<Real> hits, const LaneRayHit<Real>& record, int order, LaneWorker<Real>& worker)
    {
        if constexpr (possible) {
            const Mask<Real> mine = hits & ((record.face & face_form) == Integer<Real>(form));
            if (any<Real>(mine))
                worker.orders[std::size_t(order)].hits[form].add(mine, record);
        }
    }

    template<Form form, bool possible>
    void follow_form(LaneOrder<Real>& here, int order, LaneWorker<Real>& worker) const
    {
        if constexpr (possible) {
            auto& hits = here.hits[form];
            for (int first = 0; first < hits.count; first += lane_count<Real>) {
                if (order < depth) {
                    LaneOrder<Real>& next = worker.orders[std::size_t(order) + 1];
                    next.rays.make_room(std::max(1024, 2 * children * lane_count<Real>));
                    if (next.rays.left() < children * lane_count<Real>)
                        follow_rays(order + 1, worker);
                }
                shade<form>(first, order, worker);
            }
            hits.count = 0;
        }
    }

    void follow_rays(int order, LaneWorker<Real>& worker) const
    {
        if (order > depth || worker.orders[std::size_t(order)].rays.count == 0)
            return;
        LaneOrder<Real>& here = worker.orders[std::size_t(order)];
        for (auto& hits : here.hits)
            hits.make_room(here.rays.count + here.rays.left());
        for (int first = 0; first < here.rays.count; first += lane_count<Real>)
            meet(scene.all_shapes, up_to<Real>(here.rays.count - first), here.rays.at(first), order, worker);
        here.rays.count = 0;
        follow(order, worker);
    }

    // Colours times weights.
    [[gnu::noinline]] static void add_colours(Mask<Real> which, const LaneBranch<Real>& branch, const V& colour,
                                 LaneWorker<Real>& worker)
    {
        V weighted;
        if constexpr (needs::attenuation)
            weighted = branch.weight * colour;
        else
            weighted = scaled<Real>(branch.weight, colour);
        for (unsigned left = bits<Real>(which); left != 0; left &= left - 1) {
            const int k = std::countr_zero(left);
            const std::size_t pixel = std::size_t(branch.pixel[k]);
            worker.colours[0][pixel] += weighted.x[k];
            worker.colours[1][pixel] += weighted.y[k];
            worker.colours[2][pixel] += weighted.z[k];
        }
    }

    // What there is to know of the places where rays end.
    struct At {
        V point, normal, outward, diffuse;  // outward: OFF-1, along the normal
        L specular, exponent, lobe, from_air_n, from_air_m, into_air_n, into_air_m;
        I medium, rank;
        Mask<Real> clear, flat;
        L d_n;
    };

    template<Form form>
    LANE At surface(const LaneRayHit<Real>& hit) const
    {
        L face[LaneScene<Real>::face_fields], role[LaneScene<Real>::role_fields];
        gather<Real>(scene.faces[form].data(), hit.face >> face_rows, face);
        gather<Real>(scene.roles.data(), I(face[4]), role);

        At at;
        at.diffuse = {role[0], role[1], role[2]};
        at.specular = role[3], at.exponent = role[4];
        at.from_air_n = role[5], at.from_air_m = role[6], at.into_air_n = role[7], at.into_air_m = role[8];
        at.clear = role[9] != 0, at.rank = I(role[10]), at.medium = I(role[11]);
        at.flat = role[12] == 1, at.lobe = role[13];

        const V place{face[0], face[1], face[2]};
        if constexpr (form == form_sphere) {  // SPH-2
            at.normal = normalise<Real>(hit.point - place);
            at.point = along<Real>(place, face[3], at.normal);
        } else if constexpr (form == form_plane) {  // BOX-2, POL-3, TRI-2
            at.normal = {face[5], face[6], face[7]};
            at.point = along<Real>(hit.point, -fused_dot<Real>(hit.point - place, at.normal), at.normal);
        } else
            on_ellipsoid(hit, I(face[5]), place, at);
        at.d_n = fused_dot<Real>(hit.direction, at.normal);
        Mask<Real> turned{};
        if constexpr (form == form_plane && (needs::polygon || needs::mesh))  // POL-3, TRI-2
            turned = at.flat & ~(at.d_n < 0);
        if constexpr (needs::csg)  // CSG-5
            turned |= (role[12] == 2) & ((at.d_n > 0) ^ ((hit.face & Integer<Real>(face_leaves)) != 0));
        if constexpr (needs::csg || (form == form_plane && (needs::polygon || needs::mesh))) {
            at.normal = either<Real>(turned, -at.normal, at.normal);
            at.d_n = turned ? -at.d_n : at.d_n;
        }
        const V& n = at.normal;
        const V& p = at.point;
        const L far = size<Real>(n.x * p.x) + size<Real>(n.y * p.y) + size<Real>(n.z * p.z);
        at.outward = scaled<Real>(tracer.epsilon * fma<Real>(far, all(Real(0.125)), face[3]), n);
        return at;
    }

    // ELL-2
    LANE void on_ellipsoid(const LaneRayHit<Real>& hit, I number, const V& centre, At& at) const
    {
        V g[3]{}, axis[3]{};
        for (int k = 0; k < lane_count<Real>; k++) {
            const Ellipsoid<Real>& ellipsoid = *scene.ellipsoids[std::size_t(number[k])];
            for (int a = 0; a < 3; a++) {
                g[a].x[k] = ellipsoid.g[a].x, g[a].y[k] = ellipsoid.g[a].y, g[a].z[k] = ellipsoid.g[a].z;
                axis[a].x[k] = ellipsoid.axis[a].x, axis[a].y[k] = ellipsoid.axis[a].y, axis[a].z[k] = ellipsoid.axis[a].z;
            }
        }
        const V from = hit.point - centre;
        const V m = normalise<Real>(
            V{fused_dot<Real>(g[0], from), fused_dot<Real>(g[1], from), fused_dot<Real>(g[2], from)});
        at.normal = normalise<Real>(along<Real>(along<Real>(scaled<Real>(m.x, g[0]), m.y, g[1]), m.z, g[2]));
        at.point = along<Real>(along<Real>(along<Real>(centre, m.x, axis[0]), m.y, axis[1]), m.z, axis[2]);
    }

    template<Form form>
    void shade(int first, int order, LaneWorker<Real>& worker) const
    {
        if constexpr (needs::sobol)
            worker.order = order;
        const auto& hits = worker.orders[std::size_t(order)].hits[form];
        const Mask<Real> active = up_to<Real>(hits.count - first);
        LaneRayHit<Real> hit = hits.at(first);
        hit.face = active ? hit.face : I{}, hit.branch.pixel = active ? hit.branch.pixel : I{};  // others read row 0
        const At at = surface<form>(hit);
        const Mask<Real> enters = at.d_n <= 0;
        const LaneSides<Real> sides = media.sides(hit.branch.inside, at.medium, at.rank, enters);
        if constexpr (needs::attenuation)
            hit.branch.weight = hit.branch.weight * media.attenuation(sides.i, hit.t);

        V sum{};
        if constexpr (needs::ambient)
            sum = at.diffuse * all(tracer.ambient);  // LOC-1
        if constexpr (needs::diffuse || needs::phong || needs::shadows)
            for (std::size_t i = 0; i < tracer.lights.size(); i++) {
                const Light<Real>& light = tracer.lights[i];
                if (needs::soft && tracer.shadows && tracer.feelers > 0 && light.radius > 0)
                    add_soft_light(i, active, hit, at, sum, worker);
                else
                    add_light(all(light.position), light.colour, active, hit, at, sum, worker);
            }
        add_colours(active, hit.branch, sum, worker);
        if constexpr (needs::reflection)
            if (order < depth)
                go_on(active, hit, at, enters, sides, worker.orders[std::size_t(order) + 1].rays, worker);
    }

    // LOC-2 to LOC-4
    [[gnu::noinline]] void add_light(const V& position, const Vec3<Real>& colour, Mask<Real> active, const LaneRayHit<Real>& hit,
                        const At& at, V& sum, LaneWorker<Real>& worker) const
    {
        const V to_light = position - at.point;
        const L square = fused_dot<Real>(to_light, to_light), inverse = inverse_root<Real>(square);
        const V l = scaled<Real>(inverse, to_light);
        const L n_l = fused_dot<Real>(at.normal, l);
        Mask<Real> lit = active & (n_l > 0);
        if (needs::shadows && tracer.shadows) {
            worker.desk.counts.shadow += count<Real>(lit);
            if (any<Real>(lit))
                lit &= ~scene.blocked(lit, {at.point + at.outward, l}, square * inverse, worker.desk);
        }
        if (!any<Real>(lit))
            return;
        if constexpr (needs::diffuse)
            sum = along<Real>(sum, lit ? n_l : L{}, at.diffuse * all(colour));
        if constexpr (needs::phong) {
            const L c = fused_dot<Real>(l, hit.direction) - 2 * n_l * at.d_n;
            const Mask<Real> shines = lit & (c > 0) & (at.specular != 0);
            if (!any<Real>(shines))
                return;
            const L least = all(std::numeric_limits<Real>::min()), base = c > 1 ? all(Real(1)) : c < least ? least : c;
            const L share = shines ? at.specular * power<Real>(base, at.exponent) : L{};
            sum = along<Real>(sum, share, all(colour));
        }
    }

    // SOF-1, SOF-2
    LANE void add_soft_light([[maybe_unused]] std::size_t number, [[maybe_unused]] Mask<Real> active,
                             [[maybe_unused]] const LaneRayHit<Real>& hit, [[maybe_unused]] const At& at,
                             [[maybe_unused]] V& sum, [[maybe_unused]] LaneWorker<Real>& worker) const
    {
        if constexpr (needs::soft) {
            const Light<Real>& light = tracer.lights[number];
            V mean{};
            for (int f = 0; f < tracer.feelers; f++) {
                L u[4];
                draw_for_feeler(hit.branch, std::uint32_t(number), std::uint32_t(f), worker, u);
                const L z = 1 - 2 * u[0], rest = 1 - z * z, w = root<Real>(rest > 0 ? rest : L{});
                const Turn<Real> phi = turn<Real>(u[1]);
                const V omega{w * phi.cosine, w * phi.sine, z};
                add_light(along<Real>(all(light.position), all(light.radius), omega), light.colour, active, hit, at, mean,
                          worker);
            }
            sum = along<Real>(sum, all(1 / Real(tracer.feelers)), mean);
        }
    }

    // CUT-1: those of `wanted` whose weight is above the cut-off.
    LANE Mask<Real> uncut(Mask<Real> wanted, [[maybe_unused]] const LaneBranch<Real>& parent, [[maybe_unused]] L share,
                          [[maybe_unused]] LaneWorker<Real>& worker) const
    {
        if constexpr (needs::cutoff) {
            L weight;
            if constexpr (needs::attenuation)
                weight = share * most<Real>(most<Real>(parent.weight.x, parent.weight.y), parent.weight.z);
            else
                weight = share * parent.weight;
            const Mask<Real> cut = wanted & (weight <= cutoff);
            for (unsigned left = bits<Real>(cut); left != 0; left &= left - 1) {
                const int k = std::countr_zero(left);
                worker.dropped[std::size_t(parent.pixel[k])] += weight[k];
            }
            return wanted & ~cut;
        }
        return wanted;
    }

    // RND-4
    LANE Only<needs::random, I, 'p'> child([[maybe_unused]] const LaneBranch<Real>& parent, [[maybe_unused]] int number) const
    {
        if constexpr (needs::random)
            return I(Unsigned(parent.path) * std::make_unsigned_t<Integer<Real>>(children) +
                     std::make_unsigned_t<Integer<Real>>(1 + number));
        else
            return {};
    }

    LANE static LaneBranch<Real> weighted(const LaneBranch<Real>& parent, L share, const LaneInside<Real>& inside,
                                          const Only<needs::random, I, 'p'>& path)
    {
        LaneBranch<Real> branch = parent;
        if constexpr (needs::attenuation)
            branch.weight = scaled<Real>(share, parent.weight);
        else
            branch.weight = share * parent.weight;
        branch.inside = inside, branch.path = path;
        return branch;
    }

    // REF-2 to REF-4
    [[gnu::noinline]] void go_on(Mask<Real> active, const LaneRayHit<Real>& hit, const At& at, Mask<Real> enters,
                    const LaneSides<Real>& sides, Stream<Real, LaneRay<Real>>& rays, LaneWorker<Real>& worker) const
    {
        L n = enters ? at.from_air_n : at.into_air_n, m = enters ? at.from_air_m : at.into_air_m;
        if constexpr (needs::media)
            media.between(sides, n, m);
        const L cosine = size<Real>(at.d_n), c = cosine > 1 ? all(Real(1)) : cosine;
        const L x = 1 - n * n * (1 - c * c);
        const L s = root<Real>(x > 0 ? x : L{});
        const L a = (n * c - m * s) / (n * c + m * s), b = (m * c - n * s) / (m * c + n * s);
        const Mask<Real> matched = (n == 1) & (m == 1);
        const L part = matched ? L{} : x > 0 ? (a * a + b * b) / 2 : all(Real(1));
        const L share = at.specular * part;

        const Mask<Real> mirrors = active & (share != 0);
        const L side = enters ? all(Real(1)) : all(Real(-1));
        if (any<Real>(mirrors)) {
            const V mirrored = normalise<Real>(along<Real>(hit.direction, -2 * at.d_n, at.normal));  // REF-3, NUM-4
            const V start = along<Real>(at.point, side, at.outward);
            Mask<Real> perfect = mirrors;
            if (needs::glossy && tracer.glossy_rays > 0) {
                const Mask<Real> rough = mirrors & (at.lobe >= 0);
                perfect = mirrors & ~rough;
                if (any<Real>(rough))
                    add_glossy(rough, hit, at, start, mirrored, share, sides.was, rays, worker);
            }
            const Mask<Real> kept = uncut(perfect, hit.branch, share, worker);
            rays.add(kept, {start, mirrored, weighted(hit.branch, share, sides.was, child(hit.branch, 0))});
            worker.desk.counts.reflected += count<Real>(kept);
        }
        if constexpr (needs::transmission) {
            const L through = at.specular * (1 - part);
            const Mask<Real> passes = uncut(active & at.clear & (through != 0), hit.branch, through, worker);
            if (!any<Real>(passes))
                return;
            const L g = (enters ? -s : s) - n * at.d_n;  // TRA-1
            const V bent = normalise<Real>(along<Real>(scaled<Real>(n, hit.direction), g, at.normal));
            const V d = either<Real>(matched | at.flat, hit.direction, bent);
            LaneInside<Real> beyond{};
            if constexpr (needs::media)
                beyond = sides.beyond;
            rays.add(passes, {along<Real>(at.point, -side, at.outward), d,
                              weighted(hit.branch, through, beyond, child(hit.branch, children - 1))});
            worker.desk.counts.transmitted += count<Real>(passes);
        }
    }

    // GLO-1 to GLO-3
    LANE void add_glossy([[maybe_unused]] Mask<Real> mirrors, [[maybe_unused]] const LaneRayHit<Real>& hit,
                         [[maybe_unused]] const At& at, [[maybe_unused]] const V& start, [[maybe_unused]] const V& r,
                         [[maybe_unused]] L share, [[maybe_unused]] const LaneInside<Real>& inside,
                         [[maybe_unused]] Stream<Real, LaneRay<Real>>& rays,
                         [[maybe_unused]] LaneWorker<Real>& worker) const
    {
        if constexpr (needs::glossy) {
            const L sigma = r.z >= 0 ? all(Real(1)) : all(Real(-1)), h = -1 / (sigma + r.z), b = r.x * r.y * h;
            const V p{1 + sigma * r.x * r.x * h, sigma * b, -sigma * r.x}, q{b, sigma + r.y * r.y * h, -r.y};
            const Mask<Real> above = fused_dot<Real>(r, at.normal) > 0;
            for (int i = 0; i < tracer.glossy_rays; i++) {
                Mask<Real> wanted = mirrors;
                if (!tracer.study_weight)
                    wanted = uncut(wanted, hit.branch, share / Real(tracer.glossy_rays), worker);
                if (!any<Real>(wanted))
                    continue;
                L u[4];
                draw_for_lobe(hit.branch, std::uint32_t(i), worker, u);
                const L power_of = logarithm<Real>(1 - u[0]) / (at.lobe + 1);
                const L z = 1 + expm1<Real>(power_of), w = root<Real>(-expm1<Real>(2 * power_of));
                const Turn<Real> phi = turn<Real>(u[1]);
                const V beside = along<Real>(scaled<Real>(w * phi.cosine, p), w * phi.sine, q);
                const V straight = scaled<Real>(z, r);
                const V d = normalise<Real>(straight + beside);
                const Mask<Real> same = ~((fused_dot<Real>(d, at.normal) > 0) ^ above);
                const V direction = either<Real>(same, d, normalise<Real>(straight - beside));
                L part = share / Real(tracer.glossy_rays);
                if (tracer.study_weight) {
                    part = part * (1 + expm1<Real>(power_of * at.lobe));
                    wanted = uncut(wanted & (part != 0), hit.branch, part, worker);
                }
                rays.add(wanted, {start, direction, weighted(hit.branch, part, inside, child(hit.branch, i))});
                worker.desk.counts.reflected += count<Real>(wanted);
            }
        }
    }
};
