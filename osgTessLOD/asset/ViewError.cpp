// SPDX-License-Identifier: MIT
#include <osgTessLOD/asset/ViewError.h>

#include <algorithm>
#include <cmath>

namespace osgTessLOD {

ViewError ViewError::isotropic(float error)
{
    const float squared = error * error;
    return ViewError{{squared, squared, squared, 0.0F, 0.0F, 0.0F}};
}

double ViewError::evaluate(const std::array<double, 3>& d) const
{
    const double squared = q[0] * d[0] * d[0] + q[1] * d[1] * d[1] + q[2] * d[2] * d[2] +
                           2.0 * (q[3] * d[0] * d[1] + q[4] * d[0] * d[2] + q[5] * d[1] * d[2]);
    return std::sqrt(std::max(0.0, squared));
}

} // namespace osgTessLOD
