// SPDX-License-Identifier: MIT
// On screen (pixels) p is at s(p) = A(p − o) / w(p), where w(p) = n · (p − o) and o is the centre of projection. With v = p' − p
// and d the direction of p,
//
//   s(p') − s(p) = A(v − d (n·v)/(n·d)) / w(p') = A u / w(p'),   u: v moved along d into the plane that n is normal to.
//
// Only the part of A across n matters for u, and |u| ≤ |v × d| / cos φ, cos φ = n·d / |n|. With σ the largest singular value of
// that part and depth measured in object units, w / |n|: |s(p') − s(p)| ≤ (σ / |n|) |v × d| / (cos φ · depth of p').
#include <osgTessLOD/render/SelectionView.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace osgTessLOD {

namespace {

using osg::Vec3d;

/// How a clip coordinate grows in local space.
Vec3d gradient(const osg::Matrixd& localToClip, int coordinate)
{
    return {localToClip(0, coordinate), localToClip(1, coordinate), localToClip(2, coordinate)};
}

/// Largest singular value of the matrix of these two rows.
double largestSingularValue(const Vec3d& a, const Vec3d& b)
{
    const double squared = 0.5 * (a * a + b * b) + std::hypot(0.5 * (a * a - b * b), a * b);
    return std::sqrt(squared);
}

Vec3d unit(const Vec3d& v)
{
    return v / v.length();
}

bool isUsable(const SelectionView& view)
{
    return view.pixelScale > 0.0 && std::isfinite(view.pixelScale) && view.axis.valid() && view.eye.valid() &&
           view.leastCosine > 0.0;
}

SelectionView orthographicView(const Vec3d& xPixels, const Vec3d& yPixels, double w)
{
    SelectionView view;
    view.orthographic = true;
    view.pixelScale = largestSingularValue(xPixels, yPixels) / std::fabs(w);
    view.axis = unit(yPixels ^ xPixels);
    return view;
}

SelectionView perspectiveView(const osg::Matrixd& localToClip, double width, double height)
{
    const Vec3d x = gradient(localToClip, 0);
    const Vec3d y = gradient(localToClip, 1);
    const Vec3d w = gradient(localToClip, 3);
    // Columns of the inverse of the matrix of rows x, y, w.
    const double determinant = x * (y ^ w);
    const Vec3d fromX = (y ^ w) / determinant;
    const Vec3d fromY = (w ^ x) / determinant;
    const Vec3d fromW = (x ^ y) / determinant;
    SelectionView view;
    view.eye = -(fromX * localToClip(3, 0) + fromY * localToClip(3, 1) + fromW * localToClip(3, 3));
    view.axis = unit(w);
    // Twice a triangle's area on screen is, up to what is positive, determinant · (normal · direction from the eye).
    view.mirrored = determinant > 0.0;
    const auto across = [&](const Vec3d& v) { return v - view.axis * (v * view.axis); };
    view.pixelScale = largestSingularValue(across(x) * (0.5 * width), across(y) * (0.5 * height)) / w.length();
    for (const double cornerX : {-1.0, 1.0}) {
        for (const double cornerY : {-1.0, 1.0}) {
            const Vec3d corner = fromX * cornerX + fromY * cornerY + fromW;
            view.leastCosine = std::min(view.leastCosine, view.axis * unit(corner));
        }
    }
    return view;
}

/// Least and largest singular value of the matrix's linear part.
std::pair<double, double> singularValues(const osg::Matrixd& m)
{
    const Vec3d x = gradient(m, 0);
    const Vec3d y = gradient(m, 1);
    const Vec3d z = gradient(m, 2);
    // Smith, "Eigenvalues of a symmetric 3 × 3 matrix", 1961, for that of the products of rows.
    const double mean = (x * x + y * y + z * z) / 3.0;
    const double a = x * x - mean;
    const double b = y * y - mean;
    const double c = z * z - mean;
    const double xy = x * y;
    const double xz = x * z;
    const double yz = y * z;
    const double scale = std::sqrt((a * a + b * b + c * c + 2.0 * (xy * xy + xz * xz + yz * yz)) / 6.0);
    if (!(scale > 1e-12 * mean)) { return {std::sqrt(mean), std::sqrt(mean)}; } // all alike but for rounding
    const double determinant = a * (b * c - yz * yz) - xy * (xy * c - yz * xz) + xz * (xy * yz - b * xz);
    const double angle = std::acos(std::clamp(determinant / (2.0 * scale * scale * scale), -1.0, 1.0)) / 3.0;
    const double least = mean + 2.0 * scale * std::cos(angle + 2.0 * osg::PI / 3.0);
    return {std::sqrt(std::max(0.0, least)), std::sqrt(mean + 2.0 * scale * std::cos(angle))};
}

} // namespace

SelectionView placedView(const SelectionView& view, const osg::Matrixd& placement)
{
    // With v = M v' and u = M u', as above: |u| ≤ ‖M‖ |u'|, and n' = Mᵀ n.
    const auto [least, largest] = singularValues(placement);
    const osg::Matrixd inverse = osg::Matrixd::inverse(placement);
    SelectionView placed = view;
    if (view.orthographic) {
        placed.axis = unit(osg::Matrixd::transform3x3(view.axis, inverse));
        placed.pixelScale *= largest;
    } else {
        const Vec3d axis = osg::Matrixd::transform3x3(placement, view.axis);
        placed.eye = view.eye * inverse;
        placed.axis = unit(axis);
        placed.pixelScale *= largest / axis.length();
        placed.leastCosine = std::min(view.leastCosine, view.leastCosine * least / axis.length());
    }
    if (isUsable(placed)) { return placed; }
    SelectionView nothing;
    nothing.orthographic = view.orthographic;
    return nothing;
}

SelectionView makeSelectionView(const osg::Matrixd& localToEye, const osg::Matrixd& projection, double width,
                                double height)
{
    const osg::Matrixd localToClip = localToEye * projection;
    const bool orthographic = gradient(localToClip, 3).length() == 0.0;
    const SelectionView view = orthographic
                                   ? orthographicView(gradient(localToClip, 0) * (0.5 * width),
                                                      gradient(localToClip, 1) * (0.5 * height), localToClip(3, 3))
                                   : perspectiveView(localToClip, width, height);
    if (width > 0.0 && height > 0.0 && isUsable(view)) { return view; }
    SelectionView nothing;
    nothing.orthographic = orthographic;
    return nothing;
}

} // namespace osgTessLOD
