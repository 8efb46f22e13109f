# What Cython needs to know beside kernel.py: the types of C.
cimport cython

cdef extern from "math.h" nogil:
    cpdef double sqrt(double x)

cdef inline double hit_sphere(double[::1] spheres, Py_ssize_t i, double ox, double oy, double oz, double dx, double dy, double dz) noexcept nogil

cdef inline bint occluded(double[::1] spheres, double ox, double oy, double oz, double dx, double dy, double dz, double limit) noexcept nogil

cdef inline double reflectance(double n, double m, double cosine) noexcept nogil

@cython.locals(
    pixel=Py_ssize_t, order=Py_ssize_t, i=Py_ssize_t, near=Py_ssize_t, k=Py_ssize_t, medium=Py_ssize_t,
    ox=double, oy=double, oz=double, dx=double, dy=double, dz=double, nx=double, ny=double, nz=double,
)
cpdef render(
    double[::1] picture, double[::1] counts, double[::1] spheres, double[::1] surfaces, double[::1] exponents,
    double[::1] optics, double[::1] lights, double[::1] colours, double[::1] camera,
    Py_ssize_t x0, Py_ssize_t y0, Py_ssize_t columns, Py_ssize_t rows, double sample_x, double sample_y,
    Py_ssize_t depth, bint shadows, double epsilon,
)
