// The optics of renderers/cpp against closed forms worked out by hand, function by function and ray by ray.
// Prints what is wrong; the exit status is 1 then. Compiled by test_cpp_glass.py, in both precisions.
#include "walk.hpp"

#include <cstdio>

int failures = 0;

void expect(const char* what, double got, double wanted, double tolerance)
{
    if (!(std::abs(got - wanted) <= tolerance)) {
        std::printf("%s: %.17g, not %.17g\n", what, got, wanted);
        failures++;
    }
}

// A scene without any shape, light or colour but a white background.
Scene empty_scene()
{
    Scene scene;
    const auto table = [](auto& array, std::size_t columns) { array.shape = {0, columns}; };
    for (Array<double>* array : {&scene.lights, &scene.materials, &scene.spheres, &scene.boxes, &scene.polygon_vertices,
                                 &scene.ellipsoids, &scene.mesh_vertices, &scene.csg_spheres, &scene.csg_boxes,
                                 &scene.csg_ellipsoids})
        table(*array, 1);
    for (Array<std::int32_t>* array :
         {&scene.polygon_ranges, &scene.mesh_triangles, &scene.mesh_ranges, &scene.csg_meshes, &scene.csg_code,
          &scene.csg_ranges, &scene.sphere_ids, &scene.box_ids, &scene.polygon_ids, &scene.ellipsoid_ids,
          &scene.mesh_ids, &scene.csg_ids, &scene.media})
        table(*array, 1);
    scene.ambient = {{3}, {0, 0, 0}};
    scene.background = {{3}, {1, 1, 1}};
    scene.air = {{5}, {1, 1, 1, 1, 1}};
    return scene;
}

template<typename T>
void add_row(Array<T>& array, std::vector<T> row)
{
    array.data.insert(array.data.end(), row.begin(), row.end());
    array.shape = {array.shape[0] + 1, row.size()};
}

int add_material(Scene& scene, double eps, double mu, double attenuation)
{
    add_row(scene.materials, {0, 0, 0, 1, 10, attenuation, attenuation, attenuation, eps, mu, 0});
    return int(scene.materials.rows()) - 1;
}

Job job_of(int depth, const char* epsilon)
{
    const std::string order = "--depth=" + std::to_string(depth);
    return Job(Flags({"--job=x", "--out=x", "--width=1", "--height=1", epsilon, order}));
}

template<typename Real>
Vec3<Real> trace(const Scene& scene, int depth, Ray<Real> ray, Walk walk)
{
    const Job job = job_of(depth, sizeof(Real) == 8 ? "--epsilon=3.6e-15" : "--epsilon=1.9e-6");
    const Tracer<Real> tracer(scene, job);
    const Walker<Real> walker(tracer, walk);
    Desk<Real> desk;
    tracer.shapes.make_room(desk.scratch);
    WalkRows<Real> rows;
    walker.make_room(rows);
    return walker.colour(ray, desk, rows);
}

template<typename Real>
void test_functions(double u)
{
    // Straight on, R = ((n - 1)/(n + 1))^2 for mu = 1, from both sides.
    expect("R straight into glass", fresnel<Real>({Real(1 / 1.5), 1}, 1).reflected, 0.04, 8 * u);
    expect("R straight out of glass", fresnel<Real>({Real(1.5), 1}, 1).reflected, 0.04, 8 * u);
    // An impedance that fits, eps = mu: nothing comes back straight on, though n is 2.
    expect("R of eps = mu = 2", fresnel<Real>({Real(0.5), Real(0.5)}, 1).reflected, 0, 8 * u);
    // At Brewster's angle tan a = n only light across the plane comes back: R = ((n^2 - 1)/(n^2 + 1))^2 / 2.
    const double n = 1.5, brewster = std::atan(n);
    expect("R at Brewster's angle", fresnel<Real>({Real(1 / n), 1}, Real(std::cos(brewster))).reflected,
           std::pow((n * n - 1) / (n * n + 1), 2) / 2, 16 * u);
    expect("R beyond the critical angle", fresnel<Real>({Real(1.5), 1}, Real(0.7)).reflected, 1, 0);
    expect("R at grazing incidence", fresnel<Real>({Real(1 / 1.5), 1}, 0).reflected, 1, 8 * u);
    expect("R where the media are the same", fresnel<Real>({1, 1}, Real(0.3)).reflected, 0, 0);

    // Snell at 40 degrees into n = 1.5, and the way back out gives the angle it came at; d.n tells the side.
    const double a = 40 * pi / 180, b = std::asin(std::sin(a) / n);
    const Vec3<Real> d{Real(std::sin(a)), 0, Real(-std::cos(a))}, up{0, 0, 1};
    const Interface<Real> in{Real(1 / n), 1}, out{Real(n), 1};
    const Vec3<Real> t = transmit(in, fresnel(in, -d.z).s, d, up, d.z);
    expect("Snell, sine", t.x, std::sin(b), 4 * u);
    expect("Snell, cosine", t.z, -std::cos(b), 4 * u);
    const Vec3<Real> back = transmit(out, fresnel(out, -t.z).s, t, Vec3<Real>{0, 0, -1}, -t.z);
    expect("Snell and back, sine", back.x, std::sin(a), 8 * u);
    expect("Snell and back, cosine", back.z, -std::cos(a), 8 * u);
    // Both directions meet the surface with as much light reflected.
    expect("R from both sides", fresnel(in, -d.z).reflected, fresnel(out, -t.z).reflected, 8 * u);
}

template<typename Real>
void test_rays(double u, Walk walk)
{
    const Ray<Real> straight{{0, 0, 4}, {0, 0, -1}};
    const double r = 0.04, t = 1 - r, a = 0.6;

    // A ball of radius 1 in a white room, depth d: all but (1 - R) R^(d - 1) comes back.
    Scene ball = empty_scene();
    add_row(ball.spheres, {0, 0, 0, 1});
    add_row<std::int32_t>(ball.sphere_ids, {0, add_material(ball, 2.25, 1, 1)});
    for (int depth : {1, 2, 3, 6})
        expect("furnace", trace(ball, depth, straight, walk).x, 1 - t * std::pow(r, depth - 1), 64 * u);

    // A slab of thickness 2 that lets a^t through: reflected at its face, and through it; with depth 3 also what it
    // sends back inside, which leaves through the face again. Rays in it start epsilon times its size (OFF-1) in.
    Scene slab = empty_scene();
    add_row(slab.boxes, {-9, -9, -1, 18, 0, 0, 0, 18, 0, 0, 0, 2});
    add_row<std::int32_t>(slab.box_ids, {0, add_material(slab, 2.25, 1, a)});
    expect("Beer-Lambert, depth 2", trace(slab, 2, straight, walk).x, r + t * a * a * t, 1024 * u);
    expect("Beer-Lambert, depth 3", trace(slab, 3, straight, walk).x, r + t * a * a * (t + r * a * a * t),
           1024 * u);

    // Glass (1.5) in water (4/3), the eye in the water: the glass outranks it, and R is that between the two.
    Scene nested = empty_scene();
    add_row(nested.spheres, {0, 0, 0, 9});
    add_row(nested.spheres, {0, 0, 0, 1});
    const int water = add_material(nested, 16. / 9, 1, 1), glass = add_material(nested, 2.25, 1, 1);
    add_row<std::int32_t>(nested.sphere_ids, {0, water});
    add_row<std::int32_t>(nested.sphere_ids, {1, glass});
    add_row<std::int32_t>(nested.media, {0, water, 1});
    add_row<std::int32_t>(nested.media, {1, glass, 0});
    const double inner = std::pow((1.5 - 4. / 3) / (1.5 + 4. / 3), 2), outer = std::pow((4. / 3 - 1) / (4. / 3 + 1), 2);
    // Depth 2: reflected at the glass and out behind the eye; through the glass, no further than the water behind it.
    expect("glass in water", trace(nested, 2, straight, walk).x, inner * (1 - outer), 64 * u);
    // Depth 3: on from there, out of the water in front; and what the water's surface behind sends back ends in it, as
    // does what the glass sends back inside.
    expect("glass in water, depth 3", trace(nested, 3, straight, walk).x,
           inner * (1 - outer) + (1 - inner) * (1 - inner) * (1 - outer), 64 * u);

    // A ball of what is around it is not there.
    Scene same = empty_scene();
    add_row(same.spheres, {0.3, 0.2, 0, 1});
    add_row<std::int32_t>(same.sphere_ids, {0, add_material(same, 1, 1, 1)});
    expect("a ball of air", trace(same, 2, straight, walk).x, 1, 0);
}

template<typename Real>
void test_all(double u)
{
    test_functions<Real>(u);
    for (const Walk walk : {Walk::recursion, Walk::table, Walk::stack, Walk::least})
        test_rays<Real>(u, walk);
}

int main()
{
    test_all<double>(0x1p-53);
    test_all<float>(0x1p-24);
    return failures > 0;
}
