// The study's scene by the plainest C++: textbook formulas, each vector a struct, no guard against rounding.
// Rules of SPEC.md are named where they are kept; NOTES.md says which are not.
#include <cmath>
#include <vector>

namespace {

template <class T> struct Vector { T x, y, z; };
template <class T> Vector<T> operator+(Vector<T> a, Vector<T> b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
template <class T> Vector<T> operator-(Vector<T> a, Vector<T> b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
template <class T> Vector<T> operator*(Vector<T> a, T s) { return {a.x * s, a.y * s, a.z * s}; }
template <class T> Vector<T> operator*(Vector<T> a, Vector<T> b) { return {a.x * b.x, a.y * b.y, a.z * b.z}; }
template <class T> T dot(Vector<T> a, Vector<T> b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
template <class T> Vector<T> normalise(Vector<T> a) { return a * (1 / std::sqrt(dot(a, a))); }

template <class T> struct Sphere {
    Vector<T> centre;
    T radius;
    Vector<T> diffuse;
    T specular, exponent;
    T n, mu;  // N and M of a ray that enters (REF-1)
};

template <class T> struct Light { Vector<T> position, colour; };

template <class T> struct Scene {
    std::vector<Sphere<T>> spheres;
    std::vector<Light<T>> lights;
    Vector<T> ambient, background;
    int depth;
};

template <class T> bool hit(const Sphere<T>& sphere, Vector<T> origin, Vector<T> direction, T& t)
{
    const Vector<T> from = origin - sphere.centre;
    const T a = dot(direction, direction), b = 2 * dot(from, direction);
    const T c = dot(from, from) - sphere.radius * sphere.radius, d = b * b - 4 * a * c;
    if (d < 0)
        return false;
    const T root = std::sqrt(d), near = (-b - root) / (2 * a), far = (-b + root) / (2 * a);
    t = near > T(1e-4) ? near : far;  // a ray that leaves a surface must not meet it again
    return t > T(1e-4);
}

// REF-2
template <class T> T reflectance(T n, T m, T cosine)
{
    const T s = std::sqrt(1 - n * n * (1 - cosine * cosine));
    const T r1 = (n * cosine - m * s) / (n * cosine + m * s), r2 = (m * cosine - n * s) / (m * cosine + n * s);
    return (r1 * r1 + r2 * r2) / 2;
}

// Light along a ray. reflected: counts the mirrored rays below it.
template <class T> Vector<T> trace(const Scene<T>& scene, Vector<T> origin, Vector<T> direction, int order, long& reflected)
{
    const Sphere<T>* met = nullptr;
    T nearest = T(1e30);
    for (const Sphere<T>& sphere : scene.spheres) {
        T t;
        if (hit(sphere, origin, direction, t) && t < nearest) {
            nearest = t;
            met = &sphere;
        }
    }
    if (!met)
        return scene.background;
    const Vector<T> point = origin + direction * nearest, normal = normalise(point - met->centre);
    Vector<T> colour = met->diffuse * scene.ambient;  // LOC-1
    for (const Light<T>& light : scene.lights) {
        const Vector<T> towards = normalise(light.position - point);
        const T cosine = dot(normal, towards);
        if (cosine <= 0)
            continue;
        colour = colour + met->diffuse * light.colour * cosine;  // LOC-3
        const T highlight = -dot(normal * (2 * cosine) - towards, direction);  // LOC-4
        if (highlight > 0)
            colour = colour + light.colour * (met->specular * std::pow(highlight, met->exponent));
    }
    if (order == scene.depth)
        return colour;
    const T cosine = dot(direction, normal);
    const T weight = met->specular * (cosine < 0 ? reflectance(met->n, met->mu, -cosine)
                                                 : reflectance(1 / met->n, 1 / met->mu, cosine));
    if (weight == 0)
        return colour;
    reflected++;
    return colour + trace(scene, point, direction - normal * (2 * cosine), order + 1, reflected) * weight;  // REF-3, REF-4
}

template <class T> Vector<T> vector(const double* numbers)
{
    return {T(numbers[0]), T(numbers[1]), T(numbers[2])};
}

// Renders a region and returns the number of reflected rays (CNT-1). spheres: rows of centre, radius, colour, k_s,
// exponent, N and M. lights: position, colour. colours: ambient light, background. camera: C, u, v, e. region: x0, y0,
// x1, y1. picture: (y1 - y0, x1 - x0, 3).
template <class T>
long render(const double* spheres, int many, const double* lights, int lit, const double* colours, const double* camera,
            const int* region, int width, int height, double sample_x, double sample_y, int depth, T* picture)
{
    Scene<T> scene{{}, {}, vector<T>(colours), vector<T>(colours + 3), depth};
    for (const double* row = spheres; row < spheres + 11 * many; row += 11)
        scene.spheres.push_back({vector<T>(row), T(row[3]), vector<T>(row + 4), T(row[7]), T(row[8]), T(row[9]), T(row[10])});
    for (const double* row = lights; row < lights + 6 * lit; row += 6)
        scene.lights.push_back({vector<T>(row), vector<T>(row + 3)});
    const Vector<T> u = vector<T>(camera + 3), v = vector<T>(camera + 6), e = vector<T>(camera + 9);
    const Vector<T> eye = vector<T>(camera) + e;
    long reflected = 0;
    for (int j = region[1]; j < region[3]; j++)
        for (int i = region[0]; i < region[2]; i++) {
            const T x = 2 * (i + T(sample_x)) / width - 1, y = 1 - 2 * (j + T(sample_y)) / height;  // CAM-2
            const Vector<T> colour = trace(scene, eye, normalise(u * x + v * y - e), 0, reflected);  // CAM-3
            *picture++ = colour.x;
            *picture++ = colour.y;
            *picture++ = colour.z;
        }
    return reflected;
}

}  // namespace

#define ENTRY(name, T)                                                                                                   \
    extern "C" long name(const double* spheres, int many, const double* lights, int lit, const double* colours,          \
                         const double* camera, const int* region, int width, int height, double sample_x,                \
                         double sample_y, int depth, T* picture)                                                         \
    {                                                                                                                    \
        return render<T>(spheres, many, lights, lit, colours, camera, region, width, height, sample_x, sample_y, depth,  \
                         picture);                                                                                       \
    }

ENTRY(render_float64, double)
ENTRY(render_float32, float)
