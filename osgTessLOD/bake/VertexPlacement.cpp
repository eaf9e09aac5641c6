// SPDX-License-Identifier: MIT
// Thibaud Lambert, "Level-of-detail for hardware tessellation", 2017, §4.5 (eq. 4.1 – 4.4).
//
// The volume spanned by triangle T and the merged vertex (u, v, x) is, up to a constant factor,
//
//     A x + n_u u + n_v v + k,      A twice the triangle's area in the chart, (n_u, n_v, A) its normal in (u, v, x)
//
// with the same A for y and z: given (u, v), the best x, y and z follow one by one. What remains is a system of the size
// of the parameter's freedom: two inside the patch, one on a border, whichever way its two patches see it.
#include <osgTessLOD/bake/VertexPlacement.h>

#include <osgTessLOD/bake/ClassicPlacement.h>
#include <osgTessLOD/bake/PlacementRange.h>

#include <Eigen/Geometry>

#include <algorithm>
#include <limits>

namespace osgTessLOD::bake {

namespace {

using Eigen::Matrix2d;
using Eigen::Vector2d;
using Eigen::Vector3d;
using Freedom = Eigen::Matrix<double, 3, 2>;

/// Weight of the pull towards the contracted edge's middle (Lambert §4.5).
constexpr double kRegularization = 1e-4;

Vector2d exact(ChartPoint p)
{
    return {p.u, p.v};
}

/// Where along a side a parameter of part `part` lies changes by ±1 as along side 0: its step in the chart.
Vector2d borderDirection(const CollapseStar& star, unsigned part)
{
    const ChartPoint from = star.inPart(part, borderParameter(star.sides[0], 0));
    const ChartPoint to = star.inPart(part, borderParameter(star.sides[0], 1));
    return exact(to) - exact(from);
}

/// Sums over a star's triangles that give the objective as a quadratic of position and parameter, both counted from an
/// origin and scaled so that the star is of size 1 in space and in the chart.
class VolumeUv {
public:
    explicit VolumeUv(const CollapseStar& star)
        : _star(star)
    {
        chooseOrigin();
        chooseScale();
        for (const CollapseStar::Triangle& t : star.triangles) { add(t); }
    }

    /// The parameter that F is least for, with the position free: chart units of part 0 for Interior, else along side 0.
    Vector2d bestParameter() const
    {
        const double s = _areas + kRegularization;
        Matrix2d system = _free - _mixed.transpose() * _mixed / s;
        system.diagonal().array() += kRegularization;
        if (_star.onBorder()) { system(1, 1) = 1.0; }
        // Minus the gradient with the position eliminated.
        const Vector2d right = _mixed.transpose() * _constants / s - _freeConstants;
        const double determinant = system.determinant();
        Vector2d best = Vector2d::Zero();
        if (determinant > 0.0) { best = system.inverse() * right; }
        return _parameterOrigin + best / _parameterScale;
    }

    /// The position that F is least for, given the parameter as above.
    Vector3d bestPosition(const Vector2d& parameter) const
    {
        const Vector2d y = _parameterScale * (parameter - _parameterOrigin);
        return _origin - (_mixed * y + _constants) / (_areas + kRegularization) / _scale;
    }

    /// f for parameters from 0 to 1 and positions as they are.
    double objective(const Vector3d& position, const Vector2d& parameter) const
    {
        const Vector3d x = _scale * (position - _origin);
        const Vector2d y = _parameterScale * (parameter - _parameterOrigin);
        const double scaled = _areas * x.squaredNorm() + y.dot(_free * y) + _squaredConstants +
                              2.0 * (x.dot(_mixed * y) + x.dot(_constants) + y.dot(_freeConstants));
        const double toUnit = _parameterScale * ChartPoint::kUnits;
        return std::max(0.0, scaled) / (_scale * _scale * toUnit * toUnit * toUnit * toUnit);
    }

    Vector2d coordinates(ChartPoint parameter) const
    {
        return _star.onBorder() ? Vector2d(alongBorder(_star.sides[0], parameter), 0.0) : exact(parameter);
    }

private:
    void chooseOrigin()
    {
        const auto& [a, b] = _star.ends;
        const bool atFirst = _star.kind == CollapseStar::Kind::BorderEnd || _star.kind == CollapseStar::Kind::Corner;
        const double part = atFirst ? 0.0 : 0.5;
        _origin = (1.0 - part) * a.position + part * b.position;
        _chartOrigin[0] = (1.0 - part) * exact(a.parameter) + part * exact(b.parameter);
        if (_star.patches[1] != kNoPatch) {
            _chartOrigin[1] = (1.0 - part) * exact(_star.inPart(1, a.parameter));
            if (part > 0.0) { _chartOrigin[1] += part * exact(_star.inPart(1, b.parameter)); }
        }
        _parameterOrigin = (1.0 - part) * coordinates(a.parameter);
        if (part > 0.0) { _parameterOrigin += part * coordinates(b.parameter); }
    }

    void chooseScale()
    {
        Eigen::AlignedBox3d box;
        std::array<Eigen::AlignedBox2d, 2> charts;
        for (const CollapseStar::Triangle& t : _star.triangles) {
            for (const std::uint8_t v : t.vertices) {
                box.extend(_star.vertices[v].position);
                charts[t.part].extend(exact(_star.vertices[v].parameter));
            }
        }
        double chartSize = charts[0].diagonal().norm();
        if (_star.patches[1] != kNoPatch) { chartSize = std::max(chartSize, charts[1].diagonal().norm()); }
        const double size = box.diagonal().norm();
        _scale = size > std::numeric_limits<double>::min() ? 1.0 / size : 1.0;
        _parameterScale = 1.0 / chartSize;
        for (unsigned part = 0; part < 2 && _star.onBorder() && _star.patches[part] != kNoPatch; ++part) {
            _directions[part] = borderDirection(_star, part);
        }
    }

    void add(const CollapseStar::Triangle& t)
    {
        std::array<Vector3d, 3> x;
        std::array<Vector2d, 3> p;
        for (std::size_t k = 0; k < 3; ++k) {
            const CollapseStar::Vertex& vertex = _star.vertices[t.vertices[k]];
            x[k] = _scale * (vertex.position - _origin);
            p[k] = _parameterScale * (exact(vertex.parameter) - _chartOrigin[t.part]);
        }
        const Vector2d e1 = p[1] - p[0], e2 = p[2] - p[0];
        const Vector3d d1 = x[1] - x[0], d2 = x[2] - x[0];
        const double area = e1.x() * e2.y() - e1.y() * e2.x();
        const Vector3d alongU = e1.y() * d2 - e2.y() * d1;
        const Vector3d alongV = e2.x() * d1 - e1.x() * d2;
        const Vector3d constant = -area * x[0] - p[0].x() * alongU - p[0].y() * alongV;
        Freedom freedom;
        if (_star.onBorder()) {
            freedom.col(0) = _directions[t.part].x() * alongU + _directions[t.part].y() * alongV;
            freedom.col(1).setZero();
        } else {
            freedom.col(0) = alongU;
            freedom.col(1) = alongV;
        }
        _areas += area * area;
        _mixed += area * freedom;
        _free += freedom.transpose() * freedom;
        _constants += area * constant;
        _freeConstants += freedom.transpose() * constant;
        _squaredConstants += constant.squaredNorm();
    }

    const CollapseStar& _star;
    Vector3d _origin;
    std::array<Vector2d, 2> _chartOrigin{Vector2d::Zero(), Vector2d::Zero()};
    std::array<Vector2d, 2> _directions{Vector2d::Zero(), Vector2d::Zero()};
    Vector2d _parameterOrigin;
    double _scale = 1.0;
    double _parameterScale = 1.0;

    double _areas = 0.0;               ///< Σ A²
    Freedom _mixed = Freedom::Zero();  ///< Σ A n
    Matrix2d _free = Matrix2d::Zero(); ///< Σ nᵀn
    Vector3d _constants = Vector3d::Zero();
    Vector2d _freeConstants = Vector2d::Zero();
    double _squaredConstants = 0.0;
};

Placement placeByVolumeUv(const CollapseStar& star)
{
    const VolumeUv objective(star);
    Placement placement;
    const Vector2d wanted = objective.bestParameter();
    placement.isValid = star.onBorder() ? nearestOnBorder(star, wanted.x(), placement.parameter)
                                        : nearestInStar(star, wanted, placement.parameter);
    if (!placement.isValid) { return placement; }
    const Vector2d parameter = objective.coordinates(placement.parameter);
    placement.position = objective.bestPosition(parameter);
    placement.residual = objective.objective(placement.position, parameter);
    return placement;
}

Placement placeAtCorner(const CollapseStar& star, PlacementMethod method)
{
    Placement placement;
    placement.position = star.ends[0].position;
    placement.parameter = star.ends[0].parameter;
    placement.isValid = isValid(star, placement.parameter);
    if (method == PlacementMethod::VolumeUv) {
        placement.residual = volumeUvObjective(star, placement.position, placement.parameter);
    } else if (method == PlacementMethod::Quadric) {
        placement.residual = quadricObjective(star, placement.position);
    } else {
        placement.residual = volumeObjective(star, placement.position);
    }
    return placement;
}

} // namespace

Placement placeVertex(const CollapseStar& star, PlacementMethod method)
{
    if (star.kind == CollapseStar::Kind::Corner) { return placeAtCorner(star, method); }
    switch (method) {
    case PlacementMethod::Quadric: return placeByQuadric(star);
    case PlacementMethod::LindstromTurk: return placeByVolume(star);
    case PlacementMethod::VolumeUv: break;
    }
    return placeByVolumeUv(star);
}

double volumeUvObjective(const CollapseStar& star, const Vector3d& position, ChartPoint parameter)
{
    const VolumeUv objective(star);
    return objective.objective(position, objective.coordinates(parameter));
}

} // namespace osgTessLOD::bake
