// SPDX-License-Identifier: MIT
#include <osgTessLOD/bake/HeightField.h>

#include <osgTessLOD/asset/AssetError.h>

#include <Eigen/SparseCholesky>
#include <Eigen/SparseCore>

#include <algorithm>
#include <cassert>
#include <limits>

namespace osgTessLOD::bake {

namespace {

constexpr std::uint32_t kNone = 0xFFFFFFFFU;

/// Connected voids, each as the samples' numbers.
class VoidFinder {
public:
    explicit VoidFinder(const HeightField& field)
        : _field(field)
        , _seen(field.heights.size(), 0)
    {
    }

    /// The void around sample `start`, if it was not found before; else nothing.
    std::vector<std::size_t> around(std::size_t start)
    {
        std::vector<std::size_t> samples;
        touchesEdge = false;
        visit(start, samples);
        for (std::size_t next = 0; next < samples.size(); ++next) {
            const std::size_t column = samples[next] % _field.columns;
            const std::size_t row = samples[next] / _field.columns;
            if (column == 0 || row == 0 || column + 1 == _field.columns || row + 1 == _field.rows) {
                touchesEdge = true;
            }
            if (column > 0) { visit(samples[next] - 1, samples); }
            if (column + 1 < _field.columns) { visit(samples[next] + 1, samples); }
            if (row > 0) { visit(samples[next] - _field.columns, samples); }
            if (row + 1 < _field.rows) { visit(samples[next] + _field.columns, samples); }
        }
        return samples;
    }

    bool touchesEdge = false; ///< of the last one

private:
    void visit(std::size_t sample, std::vector<std::size_t>& samples)
    {
        if (_seen[sample] != 0 || !std::isnan(_field.heights[sample])) { return; }
        _seen[sample] = 1;
        samples.push_back(sample);
    }

    const HeightField& _field;
    std::vector<char> _seen;
};

/// Every sample of the void becomes the mean of its four neighbours.
void fillHarmonic(HeightField& field, const std::vector<std::size_t>& samples)
{
    const auto count = static_cast<Eigen::Index>(samples.size());
    std::vector<std::size_t> sorted = samples;
    std::sort(sorted.begin(), sorted.end());
    const auto unknownAt = [&](std::size_t sample) {
        const auto at = std::lower_bound(sorted.begin(), sorted.end(), sample);
        return at != sorted.end() && *at == sample ? static_cast<Eigen::Index>(at - sorted.begin()) : Eigen::Index{-1};
    };
    std::vector<Eigen::Triplet<double>> entries;
    Eigen::VectorXd right = Eigen::VectorXd::Zero(count);
    for (Eigen::Index i = 0; i < count; ++i) {
        const std::size_t sample = sorted[static_cast<std::size_t>(i)];
        entries.emplace_back(i, i, 4.0);
        for (const std::size_t beside : {sample - 1, sample + 1, sample - field.columns, sample + field.columns}) {
            const Eigen::Index unknown = unknownAt(beside);
            if (unknown >= 0) {
                entries.emplace_back(i, unknown, -1.0);
            } else {
                right[i] += static_cast<double>(field.heights[beside]);
            }
        }
    }
    Eigen::SparseMatrix<double> laplacian(count, count);
    laplacian.setFromTriplets(entries.begin(), entries.end());
    const Eigen::SimplicialLDLT<Eigen::SparseMatrix<double>> solver(laplacian); // diagonally dominant: always solvable
    const Eigen::VectorXd heights = solver.solve(right);
    for (Eigen::Index i = 0; i < count; ++i) {
        field.heights[sorted[static_cast<std::size_t>(i)]] = static_cast<float>(heights[i]);
    }
}

} // namespace

std::uint64_t HeightField::voids() const
{
    return static_cast<std::uint64_t>(
        std::count_if(heights.begin(), heights.end(), [](float height) { return std::isnan(height); }));
}

Eigen::Vector3d HeightField::position(std::uint32_t column, std::uint32_t row) const
{
    const Eigen::Vector2d place = placeAt(column, row);
    return {place.x(), place.y(), static_cast<double>(at(column, row))};
}

bool HeightField::isCutSouthEast(std::uint32_t column, std::uint32_t row) const
{
    const float down = std::fabs(at(column, row) - at(column + 1, row + 1));
    const float up = std::fabs(at(column + 1, row) - at(column, row + 1));
    return !(up < down);
}

double HeightField::heightAt(double column, double row) const
{
    const auto cellOf = [](double at, std::uint32_t count) {
        return std::min(static_cast<std::uint32_t>(std::max(at, 0.0)), count - 2);
    };
    const std::uint32_t i = cellOf(column, columns);
    const std::uint32_t j = cellOf(row, rows);
    const double s = std::clamp(column - i, 0.0, 1.0);
    const double t = std::clamp(row - j, 0.0, 1.0);
    const double nw = at(i, j);
    const double ne = at(i + 1, j);
    const double sw = at(i, j + 1);
    const double se = at(i + 1, j + 1);
    if (isCutSouthEast(i, j)) {
        return s >= t ? nw + s * (ne - nw) + t * (se - ne) : nw + t * (sw - nw) + s * (se - sw);
    }
    return s + t <= 1.0 ? nw + s * (ne - nw) + t * (sw - nw) : se + (1.0 - s) * (sw - se) + (1.0 - t) * (ne - se);
}

Eigen::Vector2d HeightField::slopeAt(double column, double row) const
{
    const auto clamped = [](double at, std::uint32_t count) { return std::clamp(at, 0.0, count - 1.0); };
    const double west = clamped(column - 1.0, columns);
    const double east = clamped(column + 1.0, columns);
    const double north = clamped(row - 1.0, rows);
    const double south = clamped(row + 1.0, rows);
    return {(heightAt(east, row) - heightAt(west, row)) / ((east - west) * spacing[0]),
            (heightAt(column, north) - heightAt(column, south)) / ((south - north) * spacing[1])};
}

std::uint64_t fillVoids(HeightField& field, std::uint64_t largest)
{
    VoidFinder finder(field);
    std::vector<std::vector<std::size_t>> voids;
    for (std::size_t sample = 0; sample < field.heights.size(); ++sample) {
        std::vector<std::size_t> samples = finder.around(sample);
        if (!samples.empty() && samples.size() <= largest && !finder.touchesEdge) {
            voids.push_back(std::move(samples));
        }
    }
    std::uint64_t filled = 0;
    for (const auto& samples : voids) {
        fillHarmonic(field, samples);
        filled += samples.size();
    }
    return filled;
}

SourceMesh triangulate(const HeightField& field)
{
    SourceMesh mesh;
    mesh.name = field.name;
    std::vector<std::uint32_t> vertices(field.heights.size(), kNone);
    for (std::uint32_t row = 0; row < field.rows; ++row) {
        for (std::uint32_t column = 0; column < field.columns; ++column) {
            if (field.isVoid(column, row)) { continue; }
            vertices[std::size_t{row} * field.columns + column] = static_cast<std::uint32_t>(mesh.positions.size());
            mesh.positions.push_back(field.position(column, row));
        }
    }
    const auto add = [&](std::uint32_t a, std::uint32_t b, std::uint32_t c) {
        if (a != kNone && b != kNone && c != kNone) { mesh.triangles.push_back({a, b, c}); }
    };
    for (std::uint32_t row = 0; row + 1 < field.rows; ++row) {
        for (std::uint32_t column = 0; column + 1 < field.columns; ++column) {
            const std::uint32_t* north = vertices.data() + std::size_t{row} * field.columns + column;
            const std::uint32_t* south = north + field.columns;
            // With a void the cell has one triangle at most: the diagonal that is whole.
            const bool southEast = north[0] == kNone || south[1] == kNone   ? false
                                   : north[1] == kNone || south[0] == kNone ? true
                                                                            : field.isCutSouthEast(column, row);
            if (southEast) {
                add(north[0], south[0], south[1]);
                add(north[0], south[1], north[1]);
            } else {
                add(north[0], south[0], north[1]);
                add(north[1], south[0], south[1]);
            }
        }
    }
    return mesh;
}

} // namespace osgTessLOD::bake
