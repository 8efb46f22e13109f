// From a ray to its light, and to the rays that come after it.
#pragma once
#include "contact.hpp"
#include "job/counts.hpp"
#include "shapes/shapes.hpp"

// A ray of the tree (REF-4): with the set of solids that it is in, and its path, which draws need.
template<typename Real>
struct Branch {
    Ray<Real> ray;
    [[no_unique_address]] Inside inside;
    [[no_unique_address]] Only<needs::random, std::uint32_t, 'p'> path;
};

// What a thread has of its own while it works out a sample.
template<typename Real>
struct Desk {
    Counts counts;
    [[no_unique_address]] Only<needs::csg, Scratch<Real>, 'c'> scratch;
    [[no_unique_address]] Only<needs::random, Draws, 'd'> draws;
    [[no_unique_address]] Only<needs::cutoff, Real, 'w'> dropped{0};  // CUT-2: of this sample
    [[no_unique_address]] Only<needs::touching, Solids, 'a'> around{0};  // MED-8: the set that feelers start in

    Probe<Real> probe(const Ray<Real>& ray)
    {
        if constexpr (needs::csg)
            return {ray, &scratch};
        else
            return {ray, {}};
    }
};

// ATT-1: a factor of light for each channel, where there is attenuation at all.
template<typename Real> using Factor = std::conditional_t<needs::attenuation, Vec3<Real>, Real>;

template<typename Real>
Factor<Real> no_attenuation()
{
    if constexpr (needs::attenuation)
        return {1, 1, 1};
    else
        return 1;
}

// Of its channels.
template<typename Real> Real most_of(Real factor) { return factor; }
template<typename Real> Real most_of(const Vec3<Real>& factor) { return std::max({factor.x, factor.y, factor.z}); }

template<typename Real>
struct Tracer {
    Shapes<Real> shapes;
    Media<Real> media;
    [[no_unique_address]] Only<needs::touching, Contact<Real>, 't'> contact;
    std::vector<Material<Real>> materials;
    std::vector<Light<Real>> lights;
    Vec3<Real> ambient, background;
    Real epsilon;
    int depth, feelers, glossy_rays;  // G of GLO-1
    bool shadows, study_weight;
    Sequence sequence;  // its matrices are the scene's

    Tracer(const Scene& scene, const Job& job)
        : shapes(scene, job), media(scene), contact(made_contact(scene, job)),
          ambient(rounded<Real>(vec(scene.ambient.row(0)))), background(rounded<Real>(vec(scene.background.row(0)))),
          epsilon(Real(job.epsilon)), depth(job.depth), feelers(needs::soft ? job.feelers : 0), glossy_rays(0),
          shadows(needs::shadows && job.shadows), study_weight(job.weight == Weight::study)
    {
        for (std::size_t i = 0; i < scene.materials.rows(); i++) {
            materials.emplace_back(scene.materials.row(i), scene.air.data.data());
            if (needs::glossy && materials.back().lobe >= 0)
                glossy_rays = job.glossy_rays;
        }
        bool soft = false;
        for (std::size_t i = 0; i < scene.lights.rows(); i++) {
            lights.emplace_back(scene.lights.row(i));
            soft = soft || (shadows && feelers > 0 && lights.back().radius > 0);
        }
        if constexpr (needs::sobol)
            if (job.sampling == Sampling::sobol) {
                sequence.matrices = scene.sobol.data.data(), sequence.dimensions = std::uint32_t(scene.sobol.rows());
                sequence.first = job.lens_radius > 0 ? 4 : 2;
                sequence.lobes = soft ? 2 * std::uint32_t(lights.size()) : 0;
                sequence.each = sequence.lobes + (glossy_rays > 0 ? 2 : 0);
            }
    }

    // RND-4: B, and so the number of children that the paths have room for.
    std::uint32_t path_base() const { return std::uint32_t(std::max(glossy_rays, 1)) + 1; }

    // WLK-1: how many children a ray can have.
    int children() const
    {
        bool transmits = false;
        for (const Material<Real>& material : materials)
            transmits = transmits || (needs::transmission && material.clear && material.specular > 0);
        return int(path_base()) - !transmits;
    }

    // What a ray of this order brings back (REF-4): on_light(its own light, A), called once; then, for each child,
    // on_child(number, ray, share). Its colour is A times the sum of that light and of share times the child's colour.
    // There is no child for which cuts(share) is true (CUT-1), which is asked before its direction is worked out.
    template<typename OnLight, typename Cuts, typename OnChild>
    [[gnu::always_inline]] void follow(const Branch<Real>& branch, int order, Desk<Real>& desk, const OnLight& on_light,
                                       const Cuts& cuts, const OnChild& on_child) const
    {
        if constexpr (needs::touching)
            if (contact.possible())
                return follow_touching(branch, order, desk, on_light, cuts, on_child);
        const Probe<Real> probe = desk.probe(branch.ray);
        const Hit<Real> hit = shapes.nearest(probe);
        if (hit.shape < 0)
            return on_light(background, no_attenuation<Real>());  // REF-6
        const Surface<Real> at = shapes.surface(probe, hit);
        const Role& role = shapes.roles[std::size_t(hit.shape)];
        const Material<Real>& material = materials[std::size_t(role.material)];
        const Real d_n = dot(branch.ray.direction, at.normal);
        const bool enters = d_n <= 0;
        const Sides sides = media.sides(branch.inside, role.material, role.rank, enters);
        on_light(light(branch, order, at, material, desk), attenuation(media[sides.i], hit.t));
        leave(branch, order, desk, cuts, on_child, at, role, material, sides, d_n, enters);
    }

private:
    auto made_contact([[maybe_unused]] const Scene& scene, [[maybe_unused]] const Job& job) const
    {
        if constexpr (needs::touching)
            return Contact<Real>(scene, shapes, media, Real(job.epsilon));
        else
            return 0;
    }

    // As `follow`, where surfaces may be in one place (MED-6 to MED-8).
    template<typename OnLight, typename Cuts, typename OnChild>
    void follow_touching(const Branch<Real>& branch, int order, Desk<Real>& desk, const OnLight& on_light,
                         const Cuts& cuts, const OnChild& on_child) const
    {
        Ray<Real> ray = branch.ray;
        auto inside = branch.inside;
        Factor<Real> dimmed = no_attenuation<Real>();
        for (;;) {
            const Probe<Real> probe = desk.probe(ray);
            const Hit<Real> hit = shapes.nearest(probe);
            if (hit.shape < 0)
                return on_light(background, no_attenuation<Real>());  // REF-6
            const Place<Real> place = contact.meet(inside, ray.direction, shapes.surface(probe, hit), hit.shape,
                                                   [&](const Ray<Real>& ray) { return desk.probe(ray); });
            const Real d_n = dot(ray.direction, place.at.normal);
            dimmed = dimmed * attenuation(media[place.sides.i], hit.t);
            if (place.none) {
                ray.origin = place.at.leave(d_n > 0 ? 1 : -1, epsilon);
                inside = place.sides.beyond;
                continue;
            }
            const Role& role = shapes.roles[std::size_t(place.shape)];
            desk.around = d_n <= 0 ? place.sides.was : place.sides.beyond;
            on_light(light(branch, order, place.at, materials[std::size_t(role.material)], desk), dimmed);
            return leave(branch, order, desk, cuts, on_child, place.at, role, materials[std::size_t(role.material)],
                         place.sides, d_n, d_n <= 0);
        }
    }

    // Is a feeler stopped (HIT-5)? What is no surface stops none (MED-8).
    bool stopped(Ray<Real> feeler, Real distance, Desk<Real>& desk) const
    {
        if (!contact.possible())
            return shapes.blocked(desk.probe(feeler), distance);
        distance = contact.reach(distance, feeler);
        if (!shapes.blocked(desk.probe(feeler), distance))
            return false;
        Solids inside = desk.around;
        while (inside != 0) {
            const Probe<Real> probe = desk.probe(feeler);
            const Hit<Real> hit = shapes.nearest(probe);
            if (!(hit.t < distance))
                return false;
            const Place<Real> place = contact.meet(inside, feeler.direction, shapes.surface(probe, hit), hit.shape,
                                                   [&](const Ray<Real>& ray) { return desk.probe(ray); });
            if (!place.none)
                return true;
            feeler.origin = place.at.leave(dot(feeler.direction, place.at.normal) > 0 ? 1 : -1, epsilon);
            distance -= hit.t;
            inside = place.sides.beyond;
        }
        return shapes.blocked(desk.probe(feeler), distance);
    }

    // The rays that leave a surface (REF-4).
    template<typename Cuts, typename OnChild>
    [[gnu::always_inline]] void leave(const Branch<Real>& branch, int order, Desk<Real>& desk, const Cuts& cuts,
                                      const OnChild& on_child, const Surface<Real>& at, const Role& role,
                                      const Material<Real>& material, const Sides& sides, Real d_n, bool enters) const
    {
        if (!needs::reflection || order == depth || material.specular == 0)  // REF-5
            return;
        const Interface<Real> interface = needs::media ? media.between(sides)
                                          : enters     ? material.from_air
                                                       : material.into_air;
        const Fresnel<Real> part = fresnel(interface, std::abs(d_n));
        const Real share = material.specular * part.reflected;
        const bool lobe = needs::glossy && glossy_rays > 0 && material.lobe >= 0;
        if (share != 0 && (lobe || !cuts(share))) {
            const Ray<Real> mirrored{at.leave(enters ? 1 : -1, epsilon), reflect(branch.ray.direction, at.normal, d_n)};
            if (lobe)
                follow_glossy(branch, order, {mirrored, sides.was, {}}, at.normal, material.lobe, share, desk, cuts,
                              on_child);
            else {
                desk.counts.reflected++;
                on_child(0, {mirrored, sides.was, child(branch, 0)}, share);
            }
        }
        if constexpr (needs::transmission) {
            const Real through = material.specular * (1 - part.reflected);
            if (!material.clear || through == 0 || cuts(through))
                return;
            const Vec3<Real> d = role.flat ? branch.ray.direction
                                           : transmit(interface, part.s, branch.ray.direction, at.normal, d_n);
            const int last = int(path_base()) - 1;
            desk.counts.transmitted++;
            on_child(last, {{at.leave(enters ? -1 : 1, epsilon), d}, sides.beyond, child(branch, last)}, through);
        }
    }

    // RND-4
    Only<needs::random, std::uint32_t, 'p'> child(const Branch<Real>& branch, int number) const
    {
        if constexpr (needs::random)
            return branch.path * path_base() + 1 + std::uint32_t(number);
        else
            return {};
    }

    // GLO-1
    template<typename Cuts, typename OnChild>
    void follow_glossy(const Branch<Real>& branch, [[maybe_unused]] int order, const Branch<Real>& mirrored,
                       Vec3<Real> n, Real exponent, Real share, Desk<Real>& desk, const Cuts& cuts,
                       const OnChild& on_child) const
    {
        if constexpr (needs::glossy)
            for (int g = 0; g < glossy_rays; g++) {
                if (!study_weight && cuts(share / Real(glossy_rays)))
                    continue;
                const auto u = desk.draws.for_lobe(Real(), order, branch.path, glossy_rays, g);
                const Lobe<Real> lobe = glossy(mirrored.ray.direction, n, exponent, u);
                const Real weight = study_weight ? std::pow(lobe.z, exponent) : Real(1);
                const Real part = share * weight / Real(glossy_rays);
                if (part == 0 || (study_weight && cuts(part)))
                    continue;
                desk.counts.reflected++;
                on_child(g, {{mirrored.ray.origin, lobe.direction}, mirrored.inside, child(branch, g)}, part);
            }
    }

    static Factor<Real> attenuation(const Medium<Real>& medium, Real t)
    {
        if constexpr (needs::attenuation)
            if (medium.attenuates)
                return {std::pow(medium.attenuation.x, t), std::pow(medium.attenuation.y, t),
                        std::pow(medium.attenuation.z, t)};
        return no_attenuation<Real>();
    }

    // LOC: the light that reaches the eye from a surface without a mirror.
    Vec3<Real> light(const Branch<Real>& branch, [[maybe_unused]] int order, const Surface<Real>& at,
                     const Material<Real>& material, Desk<Real>& desk) const
    {
        Vec3<Real> sum{0, 0, 0};
        if constexpr (needs::ambient)
            sum = material.diffuse * ambient;  // LOC-1
        if constexpr (needs::diffuse || needs::phong || needs::shadows)
            for (std::size_t i = 0; i < lights.size(); i++) {
                const Light<Real>& light = lights[i];
                if (needs::soft && shadows && feelers > 0 && light.radius > 0)
                    sum = sum + soft_light(branch, order, at, material, i, desk);
                else
                    add_light(light.position, light.colour, branch, at, material, desk, sum);
            }
        return sum;
    }

    void add_light(Vec3<Real> position, Vec3<Real> colour, const Branch<Real>& branch, const Surface<Real>& at,
                   const Material<Real>& material, Desk<Real>& desk, Vec3<Real>& sum) const
    {
        const Vec3<Real> to_light = position - at.point;
        const Real distance = length(to_light);
        const Vec3<Real> l = to_light / distance;
        const Real n_l = dot(at.normal, l);
        if (!(n_l > 0))  // LOC-2
            return;
        if (needs::shadows && shadows) {
            desk.counts.shadow++;
            if constexpr (needs::touching) {
                if (stopped({at.leave(1, epsilon), l}, distance, desk))
                    return;
            } else if (shapes.blocked(desk.probe({at.leave(1, epsilon), l}), distance))
                return;
        }
        if constexpr (needs::diffuse)
            sum = sum + n_l * material.diffuse * colour;  // LOC-3
        if constexpr (needs::phong)
            if (material.specular != 0)
                sum = sum + highlight(material, branch.ray.direction, at.normal, l, n_l) * colour;
    }

    // SOF-1
    Vec3<Real> soft_light(const Branch<Real>& branch, [[maybe_unused]] int order, const Surface<Real>& at,
                          const Material<Real>& material, std::size_t number, Desk<Real>& desk) const
    {
        Vec3<Real> sum{0, 0, 0};
        if constexpr (needs::soft) {
            const Light<Real>& light = lights[number];
            for (int f = 0; f < feelers; f++) {
                const auto u = desk.draws.for_feeler(Real(), order, branch.path, std::uint32_t(number), feelers, f);
                const Vec3<Real> omega = on_unit_sphere(u);
                add_light(light.position + light.radius * omega, light.colour, branch, at, material, desk, sum);
            }
        }
        return sum / Real(feelers);
    }
};
