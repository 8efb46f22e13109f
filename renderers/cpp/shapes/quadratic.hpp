// SPH-3: the roots of a t^2 + h t + k = 0 from their formula.
#pragma once
#include "../methods.hpp"

#include <algorithm>
#include <cmath>

// The first that is > 0; anything not greater than 0 if none is.
template<typename Real>
Real first_root(Real a, Real h, Real k)
{
    const Real delta = h * h - 4 * a * k;
    if (delta < 0)
        return 0;

    const Real root = std::sqrt(delta);
    if constexpr (methods::sphere == SphereForm::textbook) {  // the study's
        const Real near = (-h - root) / (2 * a);
        return near > 0 ? near : (-h + root) / (2 * a);
    } else {  // of Numerical Recipes
        const Real q = (h >= 0 ? h + root : h - root) / -2;
        const Real t0 = q / a, t1 = k / q, near = std::min(t0, t1);
        return near > 0 ? near : std::max(t0, t1);
    }
}

// HIT-6: how far a root can be off depends on where the ray starts, so no bounds that are padded at load hold for it.
constexpr bool roots_of_formula = methods::sphere == SphereForm::textbook || methods::sphere == SphereForm::stable;
