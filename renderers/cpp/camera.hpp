// The eye, its lens, and the screen it looks at.
#pragma once
#include "job/job.hpp"
#include "ray.hpp"
#include "shapes/scene.hpp"
#include "shade.hpp"

template<typename Real>
struct Camera {
    Vec3<Real> eye, u, v, e, lens_u, lens_v;
    Real width, height, focus;  // focus: the delta of LEN-1

    Camera(const Scene& scene, const Job& job)
        : eye(rounded<Real>(vec(scene.camera.row(0)) + vec(scene.camera.row(3)))),
          u(rounded<Real>(vec(scene.camera.row(1)))),
          v(rounded<Real>(vec(scene.camera.row(2)))),
          e(rounded<Real>(vec(scene.camera.row(3)))),
          lens_u(rounded<Real>(job.lens_radius * normalise(vec(scene.camera.row(1))))),
          lens_v(rounded<Real>(job.lens_radius * normalise(vec(scene.camera.row(2))))),
          width(Real(job.width)), height(Real(job.height)),
          focus(Real(job.focal_distance / length(vec(scene.camera.row(3)))))
    {
    }

    // CAM-2, CAM-3: the ray through a place of the picture, in pixels from its top left corner.
    Ray<Real> ray(Real column, Real row) const
    {
        const Real x = 2 * column / width - 1, y = 1 - 2 * row / height;
        return {eye, normalise(x * u + y * v - e)};
    }

    // LEN-1
    Ray<Real> ray_through_lens(Real column, Real row, const std::array<Real, 4>& draw) const
    {
        const Real x = 2 * column / width - 1, y = 1 - 2 * row / height;
        const Real rho = std::sqrt(draw[2]), phi = Real(2 * pi) * draw[3];
        const Vec3<Real> h = rho * std::cos(phi) * lens_u + rho * std::sin(phi) * lens_v;
        return {eye + h, normalise(focus * (x * u + y * v - e) - h)};
    }
};
