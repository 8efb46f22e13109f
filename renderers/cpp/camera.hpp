// The eye, and the screen it looks at.
#pragma once
#include "ray.hpp"
#include "scene.hpp"

template<typename Real>
struct Camera {
    Vec3<Real> eye, u, v, e;
    Real width, height, sample_x, sample_y;

    Camera(const Scene& scene, int width, int height, double sample_x, double sample_y)
        : eye(rounded<Real>(vec(scene.camera.row(0)) + vec(scene.camera.row(3)))),
          u(rounded<Real>(vec(scene.camera.row(1)))),
          v(rounded<Real>(vec(scene.camera.row(2)))),
          e(rounded<Real>(vec(scene.camera.row(3)))),
          width(Real(width)), height(Real(height)), sample_x(Real(sample_x)), sample_y(Real(sample_y))
    {
    }

    // CAM-2, CAM-3: the ray through column i, row j.
    Ray<Real> ray(int i, int j) const
    {
        const Real x = 2 * (Real(i) + sample_x) / width - 1;
        const Real y = 1 - 2 * (Real(j) + sample_y) / height;
        return {eye, normalise(x * u + y * v - e)};
    }
};
