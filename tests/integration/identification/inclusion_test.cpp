// An inclusion from its palpation to a scene that renders it, by the service: live on the simulated phantom,
// from what the daemon kept of that, and refused if the recording cannot show one.

#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <functional>
#include <sstream>
#include <string>

#include "tests/integration/error_detail.h"
#include "tests/integration/identification/identifying.h"
#include "tests/support/model_examples.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

constexpr double kPhantomDepthMm = 25.0;

v1::StartIdentificationRequest inclusion_request(const std::string& object,
                                                 const std::string& recording = {}) {
  v1::StartIdentificationRequest request;
  request.mutable_inclusion();
  request.set_object(object);
  request.set_recording(recording);
  request.set_adopt(true);
  return request;
}

/// Expects a place within 3 mm across and 5 mm in depth of the phantom's, and the depth within two of its
/// standard errors.
void expect_phantoms_place(const v1::IdentificationProgress& progress) {
  const double x = parameter_of(progress, "place_x_mm").value();
  const double y = parameter_of(progress, "place_y_mm").value();
  EXPECT_LT(std::hypot(x, y), 3.0);
  const v1::EstimatedParameter& depth = parameter_of(progress, "depth_mm");
  EXPECT_NEAR(depth.value(), kPhantomDepthMm, 5.0);
  EXPECT_NEAR(depth.value(), kPhantomDepthMm, 2.0 * depth.standard_error());
}

std::string scene_with(const std::string& model) {
  return "name = \"lump\"\nkind = \"explore\"\nobject_model = \"foam_ball_3d\"\n[tool]\ntip = "
         "\"ball_bearing\"\n"
         "[target]\nmodulated = false\n[[inclusion]]\nmodel = \"" +
         model + "\"\ninternal_friction = 0.15\n";
}

/// What the daemon kept of the last identification, with the names of telemetry if `as_telemetry`.
std::string kept_recording(const std::string& folder, bool as_telemetry) {
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    std::ifstream file(entry.path());
    std::string header;
    std::getline(file, header);
    if (as_telemetry) {
      for (const auto& [from, to] :
           {std::pair("position_", "sample_tip_position_"), std::pair("force_", "sample_sensor_force_")}) {
        for (const std::string axis : {"x", "y", "z"}) {
          const std::string unit = std::string(from) == "force_" ? "_N" : "_mm";
          const std::string old = "," + (from + axis) + unit;
          const auto at = header.find(old);
          EXPECT_NE(at, std::string::npos) << old << " in " << header;
          header.replace(at, old.size(), "," + (to + axis) + (unit == "_N" ? "_n" : unit));
        }
      }
    }
    std::stringstream text;
    text << header << "\n" << file.rdbuf();
    return text.str();
  }
  ADD_FAILURE() << "nothing was kept in " << folder;
  return {};
}

TEST(ServiceInclusion, IsIdentifiedStoredAndRendered) {
  const TemporaryFolder folder;
  server::DaemonConfig config = touching("phantom_hard");
  config.simulation.tip = "ball_bearing";
  config.model_store = folder.path("models.sqlite");
  const Identifying service(config);
  std::string id;
  ASSERT_TRUE(service.start(inclusion_request("lump"), &id).ok());
  EXPECT_EQ(id, "inclusion-1");
  const v1::IdentificationProgress live = service.watch(id);
  ASSERT_EQ(live.state(), v1::IDENTIFICATION_STATE_CONVERGED) << live.ShortDebugString().substr(0, 3000);
  expect_phantoms_place(live);
  ASSERT_EQ(live.coverage_size(), 1);
  EXPECT_EQ(live.coverage(0).share(), 1.0);
  EXPECT_GT(live.fit_size(), 50);

  const v1::StoredModel stored = service.stored(live.model());
  EXPECT_EQ(stored.kind(), "inclusion");
  EXPECT_EQ(stored.object(), "lump");
  EXPECT_NEAR(stored.max_displacement_mm(), 13.0, 1.5);
  EXPECT_GT(stored.max_force_n(), 2.0);
  EXPECT_TRUE(stored.converged());

  v1::LoadSceneRequest load;
  load.set_toml(scene_with("lump"));
  v1::LoadSceneResponse loaded;
  ASSERT_TRUE(ok(service.scene->LoadScene(call_context().get(), load, &loaded)));
  const std::string& text = loaded.outline().resolved_toml();
  EXPECT_NE(text.find("attenuation = "), std::string::npos) << text;
  EXPECT_EQ(text.find("model = \"lump\""), std::string::npos) << "resolved: " << text;
  bool remarked = false;
  for (const std::string& remark : loaded.outline().remarks())
    remarked =
        remarked || remark.find("from stored model " + live.model().substr(0, 12)) != std::string::npos;
  EXPECT_TRUE(remarked) << loaded.outline().ShortDebugString();
  v1::DeleteStoredModelRequest erase;
  erase.set_hash(live.model());
  v1::DeleteStoredModelResponse erased;
  EXPECT_EQ(service.model->DeleteStoredModel(call_context().get(), erase, &erased).error_code(),
            grpc::StatusCode::FAILED_PRECONDITION)
      << "the loaded scene works with it";

  // The same from what was kept of it, under its own names and under those of telemetry.
  for (const bool as_telemetry : {false, true}) {
    v1::UploadRecordingResponse uploaded;
    const std::string csv = kept_recording(folder.path("models.sqlite.data"), as_telemetry);
    ASSERT_TRUE(service.upload(csv, &uploaded).ok());
    v1::StartIdentificationRequest request = inclusion_request("again", uploaded.recording());
    if (as_telemetry) request.mutable_inclusion()->set_tip_radius_mm(8.0);  // the other time it is not known
    const v1::IdentificationProgress again = service.end_of(request);
    EXPECT_EQ(again.state(), v1::IDENTIFICATION_STATE_CONVERGED) << again.ShortDebugString().substr(0, 3000);
    expect_phantoms_place(again);
  }
}

TEST(ServiceInclusion, ARecordingWithoutForceOrPositionOrWithAWrongUnitIsRefused) {
  const Identifying service(touching("phantom"));
  struct Case {
    const char* header;
    const char* named;
  };
  for (const Case& one :
       {Case{"time_s,force_x_N,force_y_N,force_z_N,position_x_mm,position_y_mm", "position_z"},
        {"time_s,position_x_mm,position_y_mm,position_z_mm,force_x_N,force_y_N", "force_z"},
        {"time_s,position_x_mm,position_y_mm,position_z_N,force_x_N,force_y_N,force_z_N", "position_z"}}) {
    std::ostringstream csv;
    csv << one.header << "\n";
    const auto columns = std::count(one.header, one.header + std::string(one.header).size(), ',');
    for (int i = 0; i < 20; ++i) {
      csv << 1e-3 * i;
      for (int c = 0; c < columns; ++c) csv << ",0";
      csv << "\n";
    }
    v1::UploadRecordingResponse uploaded;
    ASSERT_TRUE(service.upload(csv.str(), &uploaded).ok());
    const grpc::Status status = service.start(inclusion_request("lump", uploaded.recording()));
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << one.header;
    EXPECT_NE(status.error_message().find(one.named), std::string::npos) << status.error_message();
  }
}

TEST(ServiceInclusion, ARequestThatMakesNoSenseIsRefused) {
  const Identifying service(touching("phantom"));
  using Asked = v1::InclusionTask;
  using enum grpc::StatusCode;
  const auto refused = [&](const std::function<void(Asked&)>& change, grpc::StatusCode code,
                           const std::string& object = "lump") {
    v1::StartIdentificationRequest request = inclusion_request(object);
    change(*request.mutable_inclusion());
    EXPECT_EQ(service.start(request).error_code(), code);
  };
  refused([](Asked& a) { a.set_reference_model("nobody"); }, NOT_FOUND);
  refused([](Asked& a) { a.set_reference_recording("recording-9"); }, NOT_FOUND);
  refused(
      [](Asked& a) {
        a.set_reference_model("nobody");
        a.set_reference_recording("recording-9");
      },
      INVALID_ARGUMENT);
  refused([](Asked& a) { a.set_known_depth_mm(25.0); }, INVALID_ARGUMENT);  // without a reference
  refused([](Asked& a) { a.set_reach_mm(1.0); }, OUT_OF_RANGE);
  refused([](Asked& a) { a.set_tip_radius_mm(21.0); }, OUT_OF_RANGE);
  refused([](Asked&) {}, INVALID_ARGUMENT, "");
  expect_refused_for(service.load_toml(scene_with("lmp")), NOT_FOUND, v1::ERROR_REASON_NOT_FOUND);
}

}  // namespace
}  // namespace hapticd::test
