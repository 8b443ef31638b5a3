#pragma once
// 3x3 matrices, row-major, that are rotations up to rounding.

namespace rayvox {

/// The largest deviation of rotation^T rotation from the identity: a pose may be rounded to float32.
double deviation_from_rotation(const double* rotation);

/// The inverse proper: the transpose is one only as far as the matrix is a rotation.
void invert_rotation(const double* rotation, double* inverse);

}  // namespace rayvox
