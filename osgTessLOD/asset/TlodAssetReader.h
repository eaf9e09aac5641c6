// SPDX-License-Identifier: MIT
#pragma once

#include <osgTessLOD/asset/LodAsset.h>
#include <osgTessLOD/asset/TlodContainer.h>

#include <cstddef>
#include <optional>
#include <vector>

namespace osgTessLOD {

/// Makes an asset of a .tlod file's chunks: first all but what is per vertex and texel, then that, level by level. Nothing of it is
/// validated but the chunks' sizes. Private to the asset room. Faults are thrown without the file's name.
class TlodAssetReader {
public:
    /// Reads the frame: the asset with its levels' errors, and the vertices of level 0. Checks that the file has all chunks that the
    /// asset asks for, of their sizes, and no others of known types.
    explicit TlodAssetReader(TlodContainerReader& file);

    /// To be moved out.
    LodAsset& frame() { return _frame; }
    bool hasParameters(std::size_t level) const { return _levels[level].parameters.has_value(); }
    /// Of `file`, which may be another reader of the same file: what `asset`, which the frame became, has per vertex of a level.
    void readLevel(TlodContainerReader& file, std::size_t level, LodAsset& asset) const;
    /// The same of the normals of resolution 2^level.
    void readNormals(TlodContainerReader& file, std::size_t level, LodAsset& asset) const;

private:
    struct LevelChunks {
        ChunkEntry vertices;
        std::optional<ChunkEntry> parameters;
        std::optional<ChunkEntry> uvs;
        std::optional<ChunkEntry> colors;
    };

    void readMaterials(TlodContainerReader& file);
    void takeLevel(TlodContainerReader& file, std::uint32_t level, std::uint64_t patches);
    void takeNormals(TlodContainerReader& file);

    LodAsset _frame;
    std::vector<LevelChunks> _levels;
    std::vector<ChunkEntry> _normals; ///< by resolution
};

} // namespace osgTessLOD
