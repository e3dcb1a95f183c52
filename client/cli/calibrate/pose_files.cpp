#include "client/cli/calibrate/pose_files.h"

#include <fmt/format.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>

#include "client/cli/plot/csv_table.h"
#include "client/cli/plot/recording_table.h"
#include "client/cli/session/session.h"

namespace hapticd::cli {

namespace {

constexpr int kPosesInPiece = 500;
constexpr const char* kReferenceColumns =
    "stamp_ns (or stamp_s), x_mm, y_mm, z_mm; with orientations qw, qx, qy, qz";
constexpr std::int64_t kNoTime = std::numeric_limits<std::int64_t>::min();

template <class Fill>
std::vector<v1::PushReferencePosesRequest> pieces_of(std::size_t rows, Fill&& fill) {
  std::vector<v1::PushReferencePosesRequest> pieces;
  int in_piece = kPosesInPiece;
  for (std::size_t row = 0; row < rows; ++row) {
    if (in_piece >= kPosesInPiece) {
      pieces.emplace_back();
      in_piece = 0;
    }
    if (fill(row, pieces.back())) ++in_piece;
  }
  return pieces;
}

void set(v1::Vector3& vector, double x, double y, double z) {
  vector.set_x(x);
  vector.set_y(y);
  vector.set_z(z);
}
void set(v1::Quaternion& quaternion, double w, double x, double y, double z) {
  quaternion.set_w(w);
  quaternion.set_x(x);
  quaternion.set_y(y);
  quaternion.set_z(z);
}

/// Times in ns, of a column in ns or in s.
std::vector<std::int64_t> times_ns(const CsvTable& table, const std::string& name) {
  const bool in_ns = table.has(name + "_ns");
  const double scale = in_ns ? 1.0 : 1e9;
  std::vector<std::int64_t> times;
  for (const double time : table.column(name + (in_ns ? "_ns" : "_s"))) {
    times.push_back(std::abs(scale * time) < 9e18 ? std::llround(scale * time) : kNoTime);
  }
  return times;
}

}  // namespace

std::vector<v1::PushReferencePosesRequest> read_reference_file(const std::string& path) {
  const CsvTable table = CsvTable::read(path);
  const bool turned = table.has("qw");
  for (const char* name :
       {table.has("stamp_s") ? "stamp_s" : "stamp_ns", "x_mm", "y_mm", "z_mm", "qx", "qy", "qz"}) {
    if (!table.has(name) && (turned || *name != 'q')) {
      throw LocalError("a column is missing in what the tracker saw", path, "", kReferenceColumns,
                       fmt::format("add the column '{}', or name it so", name));
    }
  }
  const std::vector<std::int64_t> stamp_ns = times_ns(table, "stamp");
  const auto& x = table.column("x_mm");
  const auto& y = table.column("y_mm");
  const auto& z = table.column("z_mm");
  const std::vector<double> none(turned ? 0 : table.rows());
  const auto& qw = turned ? table.column("qw") : none;
  const auto& qx = turned ? table.column("qx") : none;
  const auto& qy = turned ? table.column("qy") : none;
  const auto& qz = turned ? table.column("qz") : none;
  return pieces_of(table.rows(), [&](std::size_t i, v1::PushReferencePosesRequest& piece) {
    if (stamp_ns[i] == kNoTime || !std::isfinite(x[i] + y[i] + z[i])) return false;
    v1::ReferencePose& pose = *piece.add_poses();
    pose.set_stamp_ns(stamp_ns[i]);
    set(*pose.mutable_position_mm(), x[i], y[i], z[i]);
    if (turned && std::isfinite(qw[i] + qx[i] + qy[i] + qz[i])) {
      set(*pose.mutable_orientation(), qw[i], qx[i], qy[i], qz[i]);
    }
    return true;
  });
}

std::vector<v1::PushReferencePosesRequest> read_rig_file(const std::string& path) {
  const CsvTable table = read_recording(path);
  const std::vector<std::int64_t> time_ns = times_ns(table, "time");
  const auto& x = table.column("sample_tip_position_x_mm");
  const auto& y = table.column("sample_tip_position_y_mm");
  const auto& z = table.column("sample_tip_position_z_mm");
  const auto& qw = table.column("sample_orientation_w");
  const auto& qx = table.column("sample_orientation_x");
  const auto& qy = table.column("sample_orientation_y");
  const auto& qz = table.column("sample_orientation_z");
  const bool angles = table.has("angles_joint_1_rad");
  const auto angle = [&](const char* kind, int number, std::size_t row) {
    return table.column("angles_" + std::string(kind) + "_" + std::to_string(number) + "_rad")[row];
  };
  return pieces_of(table.rows(), [&](std::size_t i, v1::PushReferencePosesRequest& piece) {
    if (time_ns[i] == kNoTime || !std::isfinite(x[i] + y[i] + z[i] + qw[i])) return false;
    v1::RecordedRigPose& pose = *piece.add_rig_poses();
    pose.set_time_ns(time_ns[i]);
    set(*pose.mutable_tip_mm(), x[i], y[i], z[i]);
    set(*pose.mutable_orientation(), qw[i], qx[i], qy[i], qz[i]);
    if (angles && std::isfinite(angle("joint", 1, i))) {
      for (int k = 1; k <= 3; ++k) {
        pose.add_joint_rad(angle("joint", k, i));
        pose.add_gimbal_rad(angle("gimbal", k, i));
      }
    }
    return true;
  });
}

}  // namespace hapticd::cli
