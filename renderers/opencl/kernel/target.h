// What OpenCL C and CUDA C++ spell differently, and the type of all arithmetic (NUM-1). The host puts a line for each
// feature (NEED_SPHERE, ..), method, size and PRECISION_FLOAT32 before it, and the other files behind it.

#ifdef PRECISION_FLOAT32
typedef float real;
#else
typedef double real;
#endif
#define R(literal) ((real)(literal))  // so that no double gets into a float32 kernel

#ifdef __OPENCL_VERSION__

#if !defined(FLOATING_POINT_CONTRACT) && !defined(FLOATING_POINT_FAST)
#pragma OPENCL FP_CONTRACT OFF  // NUM-3
#endif
#ifdef PRECISION_FLOAT32
typedef float3 real3;
#else
#pragma OPENCL EXTENSION cl_khr_fp64 : enable
typedef double3 real3;
#endif
#define DEVICE static
#define CALLED static  // of what is large and stands in several places
#define KERNEL __kernel __attribute__((reqd_work_group_size(GROUP_WIDTH, GROUP_HEIGHT, 1))) void
#define GLOBAL __global
#define LOCAL __local
#define SHARED __local
#define CONSTANT __constant
#if GROUP_WIDTH * GROUP_HEIGHT > 1
#define BARRIER() barrier(CLK_LOCAL_MEM_FENCE)
#else  // a thread alone waits for none, and PoCL 3.1 fails where it should (an assertion of its compiler)
#define BARRIER()
#endif
#define R3(x, y, z) ((real3)(x, y, z))
#define LOAD3(p) vload3(0, p)
#define COLUMN_IN_GROUP get_local_id(0)
#define ROW_IN_GROUP get_local_id(1)
#define GROUP_COLUMN get_group_id(0)
#define GROUP_ROW get_group_id(1)
#define GROUPS_ACROSS get_num_groups(0)
#define GROUPS_DOWN get_num_groups(1)
#define RAISE(flag) atomic_or(flag, 1)
#define HIGHEST_BIT(set) (63 - (int)clz(set))

#else

#define DEVICE static __device__ __forceinline__
#define CALLED static __device__ __noinline__
#ifdef MAX_REGISTERS  // a cap stands alone: CUDA takes no bounds beside it
#define KERNEL extern "C" __global__ __maxnreg__(MAX_REGISTERS) void
#else
#define KERNEL extern "C" __global__ __launch_bounds__(GROUP_WIDTH * GROUP_HEIGHT, 1) void  // without the 1, ptxas spills
#endif
#define GLOBAL
#define LOCAL __shared__
#define SHARED  // of CUDA: a pointer goes anywhere
#define CONSTANT
#define BARRIER() __syncthreads()
#define COLUMN_IN_GROUP threadIdx.x
#define ROW_IN_GROUP threadIdx.y
#define GROUP_COLUMN blockIdx.x
#define GROUP_ROW blockIdx.y
#define GROUPS_ACROSS gridDim.x
#define GROUPS_DOWN gridDim.y
#define RAISE(flag) atomicOr(flag, 1)
#define HIGHEST_BIT(set) (63 - __clzll((long long)(set)))
#define INFINITY (__int_as_float(0x7f800000))
#define NAN (__int_as_float(0x7fffffff))
#define mul_hi(a, b) __umulhi(a, b)
#ifdef PRECISION_FLOAT32
#define BITS(x) __float_as_uint(x)
#else
#define BITS(x) ((unsigned long long)__double_as_longlong(x))
#endif
typedef unsigned char uchar;
typedef unsigned int uint;
typedef unsigned long long ulong;

struct real3 {
    real x, y, z;
};

DEVICE real3 R3(real x, real y, real z)
{
    real3 a = {x, y, z};
    return a;
}

DEVICE real3 LOAD3(const real *p) { return R3(p[0], p[1], p[2]); }
DEVICE real3 operator+(real3 a, real3 b) { return R3(a.x + b.x, a.y + b.y, a.z + b.z); }
DEVICE real3 operator-(real3 a, real3 b) { return R3(a.x - b.x, a.y - b.y, a.z - b.z); }
DEVICE real3 operator*(real3 a, real3 b) { return R3(a.x * b.x, a.y * b.y, a.z * b.z); }
DEVICE real3 operator*(real s, real3 a) { return R3(s * a.x, s * a.y, s * a.z); }
DEVICE real3 operator/(real3 a, real s) { return R3(a.x / s, a.y / s, a.z / s); }
DEVICE real3 operator-(real3 a) { return R3(-a.x, -a.y, -a.z); }

#endif

#ifdef MERGE_NONE
#define MERGES 0
#else
#define MERGES 1
#endif

#define THREADS (GROUP_WIDTH * GROUP_HEIGHT)  // of a group
#define RANK_IN_GROUP (ROW_IN_GROUP * GROUP_WIDTH + COLUMN_IN_GROUP)

#ifdef FLOATING_POINT_FAST
#define FAR R(3e38)  // of fast-math, which knows no infinity: a number near the largest float
#else
#define FAR ((real)INFINITY)
#endif

#ifdef PRECISION_FLOAT32
#define EPSILON R(0x1p-23)  // 2 u of NUM-2
#else
#define EPSILON R(0x1p-52)
#endif

// Where the kernel finds the scene: an address space of OpenCL.
#if defined(MEMORY_SHARED)
#define SCENE LOCAL
#elif defined(MEMORY_CONSTANT)
#define SCENE CONSTANT
#else
#define SCENE GLOBAL
#endif
#ifndef __OPENCL_VERSION__
#undef SCENE
#define SCENE
#endif

// Where a test finds its shape: in the tile, if the scene is streamed (search.h).
#if STREAMED
#define TILE SHARED
#else
#define TILE SCENE
#endif
