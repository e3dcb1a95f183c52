#include "server/identification/run/observation_file.h"

#include <fmt/format.h>

#include <iterator>
#include <system_error>

#include "hal/recording/free_disk.h"

namespace hapticd::server {

namespace {

constexpr std::size_t kBytesAtOnce = std::size_t{1} << 16U;
constexpr const char* kHeader =
    "time_s,position_x_mm,position_y_mm,position_z_mm,orientation_w,orientation_x,orientation_y,orientation_"
    "z,"
    "force_x_N,force_y_N,force_z_N,torque_x_Nmm,torque_y_Nmm,torque_z_Nmm,force_age_s,status,"
    "command_x_N,command_y_N,command_z_N";
constexpr const char* kExternalHeader = ",external_x_mm,external_y_mm,external_z_mm";

}  // namespace

hal::Result<ObservationFile> ObservationFile::create(const std::filesystem::path& path,
                                                     bool has_external_position, double keep_free_mb) {
  std::error_code failure;
  std::filesystem::create_directories(path.parent_path(), failure);
  auto opened = recording::AppendFile::open_or_create(path.string());
  auto failed = opened ? opened->truncate(0) : std::optional(opened.error());
  if (failed) {
    failed->what = "the data of the identification cannot be kept: " + failed->what;
    return *failed;
  }
  ObservationFile file(std::move(*opened), has_external_position, keep_free_mb);
  file.write(kHeader);
  if (has_external_position) file.write(kExternalHeader);
  file.write("\n");
  return file;
}

void ObservationFile::write(const std::string& text) {
  waiting_ += text;
  digest_->add(text);
  if (waiting_.size() >= kBytesAtOnce) flush();
}

void ObservationFile::flush() {
  const std::string folder = std::filesystem::path(file_.path()).parent_path().string();
  if (!failure_ && recording::free_disk_mb(folder) < keep_free_mb_) {
    failure_ = hal::Error{"the disk is nearly full", folder, "",
                          fmt::format("{:g} MB stay free", keep_free_mb_), "make room there"};
  }
  if (!failure_) failure_ = file_.append(waiting_);
  waiting_.clear();
}

void ObservationFile::add(const rt::Observation& observation) {
  const hal::RigSample& s = observation.sample;
  const std::int64_t now_us = s.time_ns / 1000;
  if (now_us <= last_us_) return;
  last_us_ = now_us;
  row_.clear();
  const auto out = std::back_inserter(row_);
  fmt::format_to(out, "{:.6f}", 1e-6 * static_cast<double>(now_us));
  // Seven digits: a tenth of a micrometre in a metre, and finer than any sensor.
  const auto vector = [&](const hal::Vector3& v) {
    fmt::format_to(out, ",{:.7g},{:.7g},{:.7g}", v.x, v.y, v.z);
  };
  vector(s.tip_position_mm);
  const hal::Quaternion& q = s.tip_orientation;
  fmt::format_to(out, ",{:.9g},{:.9g},{:.9g},{:.9g}", q.w, q.x, q.y, q.z);
  vector(s.sensor_force_n);
  vector(s.sensor_torque_n_mm);
  fmt::format_to(out, ",{:.6g},{}", 1e-9 * static_cast<double>(s.force_age_ns), s.status);
  vector(observation.device_command_n);
  if (has_external_position_) vector(observation.external_position_mm);
  row_ += '\n';
  write(row_);
}

hal::Result<std::string> ObservationFile::finish() {
  flush();
  if (failure_) {
    failure_->what = "the data of the identification are not all on the disk: " + failure_->what;
    return *failure_;
  }
  return file_.path() + ", sha256 " + digest_->finish();
}

void ObservationFile::discard() {
  std::error_code ignored;
  std::filesystem::remove(file_.path(), ignored);
}

}  // namespace hapticd::server
