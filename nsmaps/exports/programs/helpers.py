"""The few functions that a program has besides those of the engine."""

HELPERS = {
    "complex_number": """typedef struct {
    double re;
    double im;
} complex_number;""",
    "smaller": """static double smaller(double x, double y)
{
    return y < x ? y : x;
}""",
    "larger": """static double larger(double x, double y)
{
    return y > x ? y : x;
}""",
    "smaller_whole": """static int64_t smaller_whole(int64_t x, int64_t y)
{
    return y < x ? y : x;
}""",
    "larger_whole": """static int64_t larger_whole(int64_t x, int64_t y)
{
    return y > x ? y : x;
}""",
    "whole_power": """static double whole_power(double x, int64_t n)
{
    double power = 1.0;
    for (; n > 0; n >>= 1, x *= x)
        if (n & 1)
            power *= x;
    return power;
}""",
    "complex_size": """static double complex_size(complex_number x)
{
    return hypot(x.re, x.im);
}""",
    "complex_sum": """static complex_number complex_sum(complex_number x, complex_number y)
{
    return (complex_number){x.re + y.re, x.im + y.im};
}""",
    "complex_difference": """static complex_number complex_difference(complex_number x, complex_number y)
{
    return (complex_number){x.re - y.re, x.im - y.im};
}""",
    "complex_product": """static complex_number complex_product(complex_number x, complex_number y)
{
    return (complex_number){x.re * y.re - x.im * y.im, x.re * y.im + x.im * y.re};
}""",
    "complex_quotient": """static complex_number complex_quotient(complex_number x, complex_number y)
{
    if (fabs(y.re) >= fabs(y.im)) {
        const double ratio = y.im / y.re, size = y.re + y.im * ratio;
        return (complex_number){(x.re + x.im * ratio) / size, (x.im - x.re * ratio) / size};
    }
    const double ratio = y.re / y.im, size = y.re * ratio + y.im;
    return (complex_number){(x.re * ratio + x.im) / size, (x.im * ratio - x.re) / size};
}""",
}  #: in C

JULIA_HELPERS = {
    "complex_quotient": """"The quotient of complex numbers as the engine divides them."
function complex_quotient(x, y)
    if abs(y.re) >= abs(y.im)
        ratio = y.im / y.re
        size = y.re + y.im * ratio
        return complex((x.re + x.im * ratio) / size, (x.im - x.re * ratio) / size)
    end
    ratio = y.re / y.im
    size = y.re * ratio + y.im
    return complex((x.re * ratio + x.im) / size, (x.im * ratio - x.re) / size)
end""",
    "whole_power": """"A whole power as the engine computes it."
function whole_power(x, n)
    power = 1.0
    while n > 0
        power = n % 2 == 1 ? power * x : power
        n = div(n, 2)
        x = x * x
    end
    return power
end""",
}
