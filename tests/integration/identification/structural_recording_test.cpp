// The device's stiffness from recordings: of the simulated rig, made here, and of others' making.

#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <string>
#include <vector>

#include "tests/integration/error_detail.h"
#include "tests/integration/identification/identifying.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

using Start = v1::StartIdentificationRequest;

double stiffness_in(const v1::IdentificationProgress& progress) {
  return parameter_of(progress, "structural_stiffness_n_per_mm").value();
}

/// What a client asks for, on a recording.
v1::IdentificationProgress identified(const Identifying& service, const std::string& csv, Start request,
                                      const v1::RecordingDescription& description = {}) {
  v1::UploadRecordingResponse uploaded;
  EXPECT_TRUE(service.upload(csv, &uploaded, description).ok());
  request.set_recording(uploaded.recording());
  return service.end_of(request);
}

grpc::Status refusal_of(const Identifying& service, const std::string& csv, Start request,
                        const v1::RecordingDescription& description = {}) {
  v1::UploadRecordingResponse uploaded;
  EXPECT_TRUE(service.upload(csv, &uploaded, description).ok());
  request.set_recording(uploaded.recording());
  return service.start(request);
}

/// Five presses of a wall of 0.5 N/mm along one axis, 250 Hz, by a device of 2.5 N/mm; forces in mN, the
/// instrument in µm and from a different origin.
std::string along_one_axis(const std::string& header) {
  std::ostringstream csv;
  csv.precision(12);
  csv << header << '\n';
  for (int i = 0; i < 3000; ++i) {
    const double time_s = 4e-3 * i;
    const double depth_mm = 12.0 * std::sin(2.0 * M_PI * time_s / 2.4) - 2.0;
    const double force_n = depth_mm > 0.0 ? 0.5 * depth_mm : 0.0;
    csv << time_s << ',' << depth_mm << ',' << 1e3 * force_n << ',' << 1e3 * (depth_mm + force_n / 2.5 - 7.0)
        << '\n';
  }
  return csv.str();
}

/// A daemon that keeps what it identified, with this object on its rig.
class Keeping {
 public:
  explicit Keeping(const std::string& object) : service_(config(object)) {}
  const Identifying& service() const { return service_; }
  /// Identifies on the rig; what was found.
  v1::IdentificationProgress live(const Start& request) {
    const v1::IdentificationProgress end = service_.end_of(request);
    EXPECT_EQ(end.state(), v1::IDENTIFICATION_STATE_CONVERGED) << end.ShortDebugString().substr(0, 3000);
    csv = file_text(folder_.path("models.sqlite.data/") + end.identification() + ".csv");
    return end;
  }
  /// Identifies on what was kept.
  v1::IdentificationProgress again(const Start& request) const {
    const v1::IdentificationProgress end = identified(service_, csv, request);
    EXPECT_EQ(end.state(), v1::IDENTIFICATION_STATE_CONVERGED) << end.ShortDebugString().substr(0, 2000);
    return end;
  }
  std::string csv;

 private:
  server::DaemonConfig config(const std::string& object) const {
    server::DaemonConfig config = touching(object);
    config.model_store = folder_.path("models.sqlite");
    return config;
  }
  TemporaryFolder folder_;
  Identifying service_;
};

TEST(ServiceStructuralRecording, WhatTheRigKeptSaysTheSameAsTheRig) {
  Keeping rig("none");
  Start request;
  request.mutable_structural_stiffness()->set_constant(true);
  request.set_time_limit_s(300.0);
  const v1::IdentificationProgress live = rig.live(request);
  ASSERT_NE(rig.csv.find("external_x_mm"), std::string::npos);
  request.set_adopt(true);
  const v1::IdentificationProgress again = rig.again(request);
  EXPECT_NEAR(stiffness_in(again) / stiffness_in(live), 1.0, 1e-3);
  EXPECT_NEAR(stiffness_in(again), 2.537, 0.03);
  const v1::StoredModel stored = rig.service().stored(again.model());
  EXPECT_EQ(stored.device(), "phantom_1_5_high_force") << "to adopt it is to say that it is of this rig";
  ASSERT_EQ(stored.tags_size(), 1);
  EXPECT_EQ(stored.tags(0), "current");

  // The same columns, along the press only.
  v1::RecordingDescription one_axis;
  const auto map = [&](const std::string& quantity, const std::string& column, double scale) {
    v1::RecordingColumn& mapped = (*one_axis.mutable_columns())[quantity];
    mapped.set_column(column);
    mapped.set_scale(scale);
  };
  map("position", "position_z_mm", -1.0);
  map("device_force", "command_z_N", 1.0);
  map("external", "external_z_mm", -1.0);
  request.set_adopt(false);
  const v1::IdentificationProgress along = identified(rig.service(), rig.csv, request, one_axis);
  EXPECT_EQ(along.state(), v1::IDENTIFICATION_STATE_PARTIAL)
      << "one axis does not say where the presses were";
  EXPECT_NEAR(stiffness_in(along), 2.537, 0.03);
  EXPECT_GT(along.missing_size(), 0);
}

TEST(ServiceStructuralRecording, WhatTheRigKeptOfARigidObjectSaysTheSame) {
  Keeping rig("wood_plate");
  Start request;
  request.mutable_structural_stiffness()->set_rigid_contact(true);
  request.mutable_structural_stiffness()->set_least_object_stiffness_n_per_mm(40.0);  // the plate has 50
  request.set_time_limit_s(300.0);
  const v1::IdentificationProgress live = rig.live(request);
  EXPECT_EQ(parameter_of(live, "least_object_stiffness_n_per_mm").value(), 40.0);

  const v1::IdentificationProgress again = rig.again(request);
  EXPECT_NEAR(stiffness_in(again) / stiffness_in(live), 1.0, 5e-3);
  EXPECT_NEAR(parameter_of(again, "object_force_over_device_force").value(),
              parameter_of(live, "object_force_over_device_force").value(), 0.02)
      << "the sensor's columns are read as well";
}

TEST(ServiceStructuralRecording, OneAxisMayHaveAnyDirectionAndUnits) {
  const Identifying service(touching("none", true));
  Start request;
  request.mutable_structural_stiffness()->set_constant(true);
  for (const double x : {0.0, 1.0}) {
    request.mutable_press_direction()->set_x(x);
    request.mutable_press_direction()->set_z(x - 1.0);
    const auto end = identified(service, along_one_axis("time_s,position_mm,force_mN,external_um"), request);
    ASSERT_FALSE(end.model().empty()) << end.ShortDebugString().substr(0, 2000);
    EXPECT_NEAR(stiffness_in(end), 2.5, 2.5e-3);
    const v1::StoredModel stored = service.stored(end.model());
    EXPECT_NEAR(stored.max_force_n(), 5.0, 0.1);
    EXPECT_EQ(stored.device(), "") << "of which device it is no one has said";
    ASSERT_GT(end.remarks_size(), 0);
    EXPECT_NE(end.remarks(end.remarks_size() - 1).find("adopt"), std::string::npos);
  }
}

TEST(ServiceStructuralRecording, WhatIsMissingIsNamedWithItsUnitAndARemedy) {
  const Identifying service(touching("none", true));
  Start walls;
  walls.mutable_structural_stiffness()->set_constant(true);
  Start rigid;
  rigid.mutable_structural_stiffness()->set_rigid_contact(true);
  Start no_direction = walls;
  no_direction.mutable_press_direction();
  Start soft = rigid;
  soft.mutable_structural_stiffness()->set_least_object_stiffness_n_per_mm(1.0);
  Start not_rigid = walls;
  not_rigid.mutable_structural_stiffness()->set_least_object_stiffness_n_per_mm(500.0);
  const auto mapped = [](const std::vector<std::string>& quantities) {
    v1::RecordingDescription description;
    for (const std::string& quantity : quantities) {
      (*description.mutable_columns())[quantity].set_column("position_mm");
    }
    return description;
  };
  struct Case {
    Start request;
    std::string header;
    std::vector<std::string> quantities;  ///< mapped to position_mm
    std::vector<std::string> words;
    grpc::StatusCode code = grpc::StatusCode::INVALID_ARGUMENT;
  };
  const std::string good = "time_s,position_mm,force_mN,external_um";
  const std::vector<Case> cases{
      {walls, "time_s,position_mm,force_mN,lvdt_um", {}, {"external_mm", "lvdt_um", "rigid_contact"}},
      {walls, "time_s,position_mm,load_psi,external_um", {}, {"device_force_N", "load_psi"}},
      {walls, "time_s,height_in,force_mN,external_um", {}, {"position_mm", "height_in"}},
      {walls, "time_s,position_mm,force_mN,external_x_um", {}, {"external_y", "external_x_um"}},
      {walls, good, {"external", "external_x"}, {"external", "one"}},
      {walls, good, {"exernal"}, {"exernal", "external"}},
      {no_direction, good, {}, {"press_direction"}},
      {rigid, "time_s,position_mm,x,y", {}, {"device_force_N"}},
      {rigid, good, {"external"}, {"external", "device_force"}},
      {soft, good, {}, {"least_object_stiffness_n_per_mm", "N/mm"}, grpc::StatusCode::OUT_OF_RANGE},
      {not_rigid, good, {}, {"least_object_stiffness_n_per_mm", "rigid_contact"}},
  };
  for (const Case& one : cases) {
    const grpc::Status status =
        refusal_of(service, along_one_axis(one.header), one.request, mapped(one.quantities));
    EXPECT_EQ(status.error_code(), one.code) << one.header << ": " << status.error_message();
    for (const std::string& word : one.words) {
      EXPECT_NE(detail_of(status).ShortDebugString().find(word), std::string::npos)
          << word << " in " << detail_of(status).ShortDebugString();
    }
  }
  // Signs cannot be seen in a header: the end shows.
  v1::RecordingDescription turned;
  (*turned.mutable_columns())["device_force"].set_scale(-1.0);
  const auto end = identified(service, along_one_axis(good), walls, turned);
  EXPECT_EQ(end.state(), v1::IDENTIFICATION_STATE_FAILED);
  EXPECT_NE(end.problem().remedy().find("signs and units"), std::string::npos)
      << end.problem().ShortDebugString();
}

}  // namespace
}  // namespace hapticd::test
