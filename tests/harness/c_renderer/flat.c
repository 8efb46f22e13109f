/* A small renderer in plain C: spheres in ambient and diffuse light (renderers/SPEC.md), and nothing else. */
#define _POSIX_C_SOURCE 199309L
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

typedef struct { double x, y, z; } Vec;
static Vec vec(const double *row) { return (Vec){row[0], row[1], row[2]}; }
static Vec add(Vec a, double s, Vec b) { return (Vec){a.x + s * b.x, a.y + s * b.y, a.z + s * b.z}; } /* a + s b */
static double dot(Vec a, Vec b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
static Vec unit(Vec a) { double n = sqrt(dot(a, a)); return (Vec){a.x / n, a.y / n, a.z / n}; }

static char **arguments;
static int spheres, lights, others;
static const double *camera, *ambient, *background, *sphere, *light, *material;
static const int *id; /* of each sphere: object, material */

static double now(void) { struct timespec t; clock_gettime(CLOCK_MONOTONIC, &t); return t.tv_sec + 1e-9 * t.tv_nsec; }
static void stop(int status, const char *why, const char *name)
{
    printf("{\"event\": \"error\", \"reason\": \"%s %s\"}\n", why, name);
    exit(status);
}
static const char *flag(const char *key) /* the value behind "--key=", or "" */
{
    for (char **a = arguments; *a; a++)
        if (!strncmp(*a, key, strlen(key))) return *a + strlen(key);
    return "";
}
static void *array(const char *name, size_t row, int *rows) /* what a .npy file holds, in rows of `row` bytes */
{
    char path[4096];
    unsigned char head[10];
    snprintf(path, sizeof path, "%s/%s.npy", flag("--job="), name);
    FILE *file = fopen(path, "rb");
    if (!file || fread(head, 1, 10, file) != 10) stop(1, "cannot read", name);
    fseek(file, 0, SEEK_END);
    long start = 10 + head[8] + 256 * head[9], bytes = ftell(file) - start;
    void *data = malloc((size_t)bytes + 1);
    fseek(file, start, SEEK_SET);
    *rows = (int)(fread(data, 1, (size_t)bytes, file) / row);
    fclose(file);
    return data;
}

static void render(Vec eye, Vec d, double *pixel)
{
    const double *hit = NULL;
    double best = INFINITY;
    for (const double *s = sphere; s < sphere + 4 * spheres; s += 4) { /* SPH-1 */
        Vec f = add(eye, -1, vec(s)), l = add(f, -dot(f, d), d);
        double b = -dot(f, d), delta = s[3] * s[3] - dot(l, l), k = dot(f, f) - s[3] * s[3];
        if (delta < 0 || (k > 0 && b <= 0)) continue;
        double t = k > 0 ? k / (b + sqrt(delta)) : b >= 0 ? b + sqrt(delta) : k / (b - sqrt(delta));
        if (t > 0 && t < best) best = t, hit = s;
    }
    memcpy(pixel, background, 3 * sizeof *pixel);
    if (!hit) return;
    const double *colour = material + 11 * id[(hit - sphere) / 4 * 2 + 1];
    Vec n = unit(add(add(eye, best, d), -1, vec(hit))), p = add(vec(hit), hit[3], n); /* SPH-2 */
    for (int a = 0; a < 3; a++) pixel[a] = colour[a] * ambient[a]; /* LOC-1 */
    for (const double *from = light; from < light + 7 * lights; from += 7) {
        double cosine = dot(n, unit(add(vec(from), -1, p)));
        for (int a = 0; a < 3 && cosine > 0; a++) pixel[a] += colour[a] * cosine * from[3 + a]; /* LOC-3 */
    }
}

int main(int argc, char **argv)
{
    arguments = argv + (argc > 0);
    char needs[1024], path[4096];
    snprintf(needs, sizeof needs, "%s", flag("--needs="));
    for (char *need = strtok(needs, ","); need; need = strtok(NULL, ","))
        if (strcmp(need, "sphere") && strcmp(need, "ambient") && strcmp(need, "diffuse"))
            stop(3, "does not support", need);
    camera = array("camera", 24, &others), ambient = array("ambient", 8, &others);
    background = array("background", 8, &others), material = array("materials", 88, &others);
    id = array("sphere_ids", 8, &others), sphere = array("spheres", 32, &spheres), light = array("lights", 56, &lights);
    const Vec u = vec(camera + 3), v = vec(camera + 6), e = vec(camera + 9), eye = add(vec(camera), 1, e);
    double sx = atof(flag("--sample_x=")), sy = atof(flag("--sample_y=")), begin = now();
    int width = atoi(flag("--width=")), height = atoi(flag("--height="));
    size_t pixels = (size_t)width * (size_t)height;
    double *picture = malloc(pixels * 3 * sizeof *picture + 1);

    for (int frame = 0; frame <= atoi(flag("--frames=")); frame++) {
        double start = now(), *pixel = picture;
        for (int j = 0; j < height; j++)
            for (int i = 0; i < width; i++, pixel += 3) { /* CAM-2, CAM-3 */
                Vec q = add(add((Vec){-e.x, -e.y, -e.z}, 2 * (i + sx) / width - 1, u), 1 - 2 * (j + sy) / height, v);
                render(eye, unit(q), pixel);
            }
        printf("{\"event\": \"frame\", \"index\": %d, \"start\": %.9f, \"end\": %.9f}\n", frame, start, now());
    }
    printf("{\"event\": \"phase\", \"name\": \"render\", \"start\": %.9f, \"end\": %.9f}\n", begin, now());
    printf("{\"event\": \"rays\", \"primary\": %zu, \"reflected\": 0, \"transmitted\": 0, \"shadow\": 0, "
           "\"non_finite\": 0}\n", pixels);

    snprintf(path, sizeof path, "%s/image.npy", flag("--out="));
    FILE *file = fopen(path, "wb");
    if (!file) stop(1, "cannot write", "image.npy");
    int length = fprintf(file, "\x93NUMPY\x01%c%c%c{'descr': '<f8', 'fortran_order': False, 'shape': (%d, %d, 3), }",
                         0, 118, 0, height, width);
    fprintf(file, "%*s\n", 127 - length, ""); /* the header has 10 + 118 bytes */
    if (fwrite(picture, 24, pixels, file) != pixels || fclose(file)) stop(1, "cannot write", "image.npy");
    printf("{\"event\": \"output\", \"file\": \"image.npy\"}\n");
    return 0;
}
