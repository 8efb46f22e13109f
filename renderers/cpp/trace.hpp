// From a ray to its colour.
#pragma once
#include "box.hpp"
#include "counts.hpp"
#include "ellipsoid.hpp"
#include "job.hpp"
#include "polygon.hpp"
#include "scene.hpp"
#include "shade.hpp"
#include "sphere.hpp"

// The nearest hit so far. Shapes are numbered through all kinds in the order of HIT-2; -1 is none.
template<typename Real>
struct Hit {
    Real t = std::numeric_limits<Real>::infinity();
    int shape = -1;
};

template<typename Real>
struct Tracer {
    std::vector<Sphere<Real>> spheres;
    std::vector<Box<Real>> boxes;
    std::vector<Polygon<Real>> polygons;
    std::vector<Ellipsoid<Real>> ellipsoids;
    std::vector<int> objects, material_of;  // by shape
    std::vector<Material<Real>> materials;
    std::vector<Light<Real>> lights;
    Vec3<Real> ambient, background;
    Real epsilon;
    int depth;
    bool shadows;

    Tracer(const Scene& scene, const Job& job)
        : ambient(rounded<Real>(vec(scene.ambient.row(0)))), background(rounded<Real>(vec(scene.background.row(0)))),
          epsilon(Real(job.epsilon)), depth(job.depth), shadows(job.shadows)
    {
        for (std::size_t i = 0; i < scene.spheres.rows(); i++)
            spheres.emplace_back(scene.spheres.row(i));
        for (std::size_t i = 0; i < scene.boxes.rows(); i++)
            boxes.emplace_back(scene.boxes.row(i));
        for (std::size_t i = 0; i < scene.polygon_ranges.rows(); i++) {
            const std::int32_t* range = scene.polygon_ranges.row(i);
            polygons.emplace_back(scene.polygon_vertices.row(std::size_t(range[0])), range[1]);
        }
        for (std::size_t i = 0; i < scene.ellipsoids.rows(); i++)
            ellipsoids.emplace_back(scene.ellipsoids.row(i));
        for (const auto* ids : {&scene.sphere_ids, &scene.box_ids, &scene.polygon_ids, &scene.ellipsoid_ids})
            for (std::size_t i = 0; i < ids->rows(); i++) {
                objects.push_back(ids->row(i)[0]);
                material_of.push_back(ids->row(i)[1]);
            }
        for (std::size_t i = 0; i < scene.materials.rows(); i++)
            materials.emplace_back(scene.materials.row(i), scene.air.data.data());
        for (std::size_t i = 0; i < scene.lights.rows(); i++)
            lights.emplace_back(scene.lights.row(i));
    }

    // HIT-1, HIT-2
    Hit<Real> nearest(const Ray<Real>& ray) const
    {
        Hit<Real> hit;
        int number = 0;
        const auto among = [&](const auto& shapes) {
            for (const auto& shape : shapes) {
                const Real t = shape.distance(ray);
                if (t > 0 && t < hit.t)
                    hit = {t, number};
                number++;
            }
        };
        among(spheres);
        among(boxes);
        among(polygons);
        among(ellipsoids);
        return hit;
    }

    // HIT-5
    bool blocked(const Ray<Real>& feeler, Real distance) const
    {
        const auto by = [&](const auto& shapes) {
            for (const auto& shape : shapes) {
                const Real t = shape.distance(feeler);
                if (t > 0 && t < distance)
                    return true;
            }
            return false;
        };
        return by(spheres) || by(boxes) || by(polygons) || by(ellipsoids);
    }

    Surface<Real> surface(const Ray<Real>& ray, const Hit<Real>& hit) const
    {
        std::size_t i = std::size_t(hit.shape);
        if (i < spheres.size())
            return spheres[i].surface(ray, hit.t);
        i -= spheres.size();
        if (i < boxes.size())
            return boxes[i].surface(ray, hit.t);
        i -= boxes.size();
        if (i < polygons.size())
            return polygons[i].surface(ray, hit.t);
        return ellipsoids[i - polygons.size()].surface(ray, hit.t);
    }

    // LOC: the light that reaches the eye from a surface without a mirror.
    Vec3<Real> light(const Ray<Real>& ray, const Surface<Real>& at, const Material<Real>& material, Counts& counts) const
    {
        Vec3<Real> sum = material.diffuse * ambient;  // LOC-1
        for (const Light<Real>& light : lights) {
            const Vec3<Real> to_light = light.position - at.point;
            const Real distance = length(to_light);
            const Vec3<Real> l = to_light / distance;
            const Real n_l = dot(at.normal, l);
            if (!(n_l > 0))  // LOC-2
                continue;
            if (shadows) {
                counts.shadow++;
                if (blocked({at.leave(1, epsilon), l}, distance))
                    continue;
            }
            sum = sum + n_l * material.diffuse * light.colour;  // LOC-3
            if (material.specular != 0)
                sum = sum + highlight(material, ray.direction, at.normal, l, n_l) * light.colour;
        }
        return sum;
    }

    // REF-4, as a loop: without transmission a ray has one child at most.
    Vec3<Real> colour(Ray<Real> ray, Counts& counts) const
    {
        Vec3<Real> sum{0, 0, 0};
        Real weight = 1;
        for (int order = 0;; order++) {
            const Hit<Real> hit = nearest(ray);
            if (hit.shape < 0)
                return sum + weight * background;  // REF-6
            const Surface<Real> at = surface(ray, hit);
            const Material<Real>& material = materials[std::size_t(material_of[std::size_t(hit.shape)])];
            sum = sum + weight * light(ray, at, material, counts);

            if (order == depth || material.specular == 0)  // REF-5
                return sum;
            const Real d_n = dot(ray.direction, at.normal);
            const bool outside = d_n <= 0;
            const Real share = material.specular * fresnel(outside ? material.from_air : material.into_air, std::abs(d_n));
            if (share == 0)
                return sum;
            counts.reflected++;
            weight = weight * share;
            ray = {at.leave(outside ? 1 : -1, epsilon), reflect(ray.direction, at.normal, d_n)};
        }
    }
};
