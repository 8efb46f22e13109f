// Numbers that count what is done with them: in their place the kernels tell the floating-point operations of a frame.
#pragma once
#include "npy.hpp"

#include <cmath>
#include <compare>
#include <limits>
#include <type_traits>

// As they stand in the source: a fused multiply-add is a sum and a product. Comparisons, signs and copies are none.
struct Operations {
    long long sums = 0, products = 0, divisions = 0, roots = 0, functions = 0;
};
inline Operations operations;  // of the program's one thread

template<typename Base>
struct Counted {
    Base value;

    Counted() = default;
    template<typename Number>
        requires std::is_arithmetic_v<Number>
    constexpr Counted(Number number) : value(Base(number))
    {
    }
    template<typename Number>
        requires std::is_arithmetic_v<Number>
    constexpr explicit operator Number() const
    {
        return Number(value);
    }

    // What the compiler works out is no operation of a frame.
    [[gnu::always_inline]] static constexpr Counted done(long long Operations::* kind, Base result)
    {
        if (!std::is_constant_evaluated() && !__builtin_constant_p(result))
            operations.*kind += 1;
        return result;
    }

    [[gnu::always_inline]] friend constexpr Counted operator+(Counted a, Counted b)
    {
        return done(&Operations::sums, a.value + b.value);
    }
    [[gnu::always_inline]] friend constexpr Counted operator-(Counted a, Counted b)
    {
        return done(&Operations::sums, a.value - b.value);
    }
    [[gnu::always_inline]] friend constexpr Counted operator*(Counted a, Counted b)
    {
        return done(&Operations::products, a.value * b.value);
    }
    [[gnu::always_inline]] friend constexpr Counted operator/(Counted a, Counted b)
    {
        return done(&Operations::divisions, a.value / b.value);
    }
    constexpr Counted operator-() const { return -value; }
    constexpr Counted& operator+=(Counted other) { return *this = *this + other; }
    constexpr Counted& operator-=(Counted other) { return *this = *this - other; }
    constexpr Counted& operator*=(Counted other) { return *this = *this * other; }
    constexpr Counted& operator/=(Counted other) { return *this = *this / other; }
    friend constexpr bool operator==(Counted a, Counted b) { return a.value == b.value; }
    friend constexpr auto operator<=>(Counted a, Counted b) { return a.value <=> b.value; }
};

template<typename Real> struct Machine;  // in bvh.hpp
template<typename Base> struct Machine<Counted<Base>> : Machine<Base> {};

template<> constexpr const char* dtype<Counted<double>> = dtype<double>;
template<> constexpr const char* dtype<Counted<float>> = dtype<float>;

// The kernels call these by their names in std. To add to std is not for programs that are shipped; this one measures.
namespace std {
template<typename Base>
struct numeric_limits<Counted<Base>> : numeric_limits<Base> {
    static constexpr Counted<Base> epsilon() { return numeric_limits<Base>::epsilon(); }
    static constexpr Counted<Base> infinity() { return numeric_limits<Base>::infinity(); }
    static constexpr Counted<Base> max() { return numeric_limits<Base>::max(); }
    static constexpr Counted<Base> min() { return numeric_limits<Base>::min(); }
};

template<typename Base> Counted<Base> abs(Counted<Base> x) { return abs(x.value); }
template<typename Base> bool isfinite(Counted<Base> x) { return isfinite(x.value); }
template<typename Base> bool signbit(Counted<Base> x) { return signbit(x.value); }

template<typename Base>
Counted<Base> fma(Counted<Base> a, Counted<Base> b, Counted<Base> c)
{
    operations.products++;
    return Counted<Base>::done(&Operations::sums, fma(a.value, b.value, c.value));
}

template<typename Base> Counted<Base> sqrt(Counted<Base> x)
{
    return Counted<Base>::done(&Operations::roots, sqrt(x.value));
}

#define FUNCTION(name)                                                                                                  \
    template<typename Base> Counted<Base> name(Counted<Base> x)                                                         \
    {                                                                                                                   \
        return Counted<Base>::done(&Operations::functions, name(x.value));                                              \
    }
FUNCTION(sin)
FUNCTION(cos)
FUNCTION(log)
FUNCTION(log2)
FUNCTION(expm1)
#undef FUNCTION

template<typename Base> Counted<Base> pow(Counted<Base> x, Counted<Base> y)
{
    return Counted<Base>::done(&Operations::functions, pow(x.value, y.value));
}

template<typename Base> Counted<Base> hypot(Counted<Base> x, Counted<Base> y, Counted<Base> z)
{
    return Counted<Base>::done(&Operations::functions, hypot(x.value, y.value, z.value));
}
}  // namespace std
