#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <sstream>
#include <string>

#include "hapticd/v1/identification.grpc.pb.h"
#include "tests/integration/error_detail.h"
#include "tests/integration/identification/identifying.h"
#include "tests/support/temporary_folder.h"

namespace hapticd::test {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

v1::StartIdentificationRequest contact(const std::string& object) {
  v1::StartIdentificationRequest request;
  request.mutable_contact();
  request.set_object(object);
  return request;
}

/// Presses of different depths on f = K x^m (1 + B/K v), 200 Hz.
std::string pressed(double stiffness, double exponent, double ratio_s_per_mm) {
  std::ostringstream csv;
  csv.precision(12);
  csv << "time_s,force_N,indentation_mm\n";
  double phase = 0.0;
  for (int i = 0; i < 6000; ++i) {
    const double t = 5e-3 * i;
    const double radians_per_s = 2.0 * M_PI * (0.2 + 0.05 * std::floor(t / 5.0));
    phase += 5e-3 * radians_per_s;
    const double x = 4.0 * (1.0 - std::cos(phase));
    const double v = 4.0 * radians_per_s * std::sin(phase);
    const double f = x > 0.0 ? stiffness * std::pow(x, exponent) * (1.0 + ratio_s_per_mm * v) : 0.0;
    csv << t << ',' << f << ',' << x << '\n';
  }
  return csv.str();
}

TEST(ServiceIdentification, TouchesAnObjectStoresAModelAndScenesUseIt) {
  const Identifying service(touching("rubber_ball_3d"));
  v1::StartIdentificationRequest request = contact("mine");
  request.set_adopt(true);
  request.set_time_limit_s(120.0);
  std::string id;
  ASSERT_TRUE(service.start(request, &id).ok());
  EXPECT_EQ(id, "contact-1");
  const v1::IdentificationProgress result = service.watch(id);
  ASSERT_EQ(result.state(), v1::IDENTIFICATION_STATE_CONVERGED) << result.ShortDebugString().substr(0, 3000);
  EXPECT_EQ(result.kind(), "contact");
  EXPECT_EQ(result.object(), "mine");
  EXPECT_EQ(result.model().size(), 64U);
  EXPECT_EQ(result.missing_size(), 0);
  ASSERT_GE(result.coverage_size(), 1);
  EXPECT_EQ(result.coverage(0).counts_size(),
            static_cast<int>(result.coverage(0).x().bins() * result.coverage(0).y().bins()));
  EXPECT_GT(result.fit_size(), 10);
  EXPECT_LE(result.fit_size(), 200);
  EXPECT_GT(parameter_of(result, "exponent").value(), 1.0);

  const v1::StoredModel stored = service.stored(result.model().substr(0, 12));
  EXPECT_EQ(stored.device(), "phantom_1_5_high_force");
  EXPECT_TRUE(stored.converged());
  ASSERT_EQ(stored.tags_size(), 1);
  EXPECT_EQ(stored.tags(0), "current");

  v1::LoadSceneRequest load;
  load.set_name("explore_bearing");
  load.set_object_model("mine");
  v1::LoadSceneResponse loaded;
  EXPECT_TRUE(ok(service.scene->LoadScene(call_context().get(), load, &loaded)));
}

TEST(ServiceIdentification, FrictionStructureToolThresholdAndGainsConvergeTooOneAfterTheOther) {
  server::DaemonConfig config = touching("rubber_ball_3d");
  config.simulation.tool_mass_g = 12.59;
  const Identifying service(config);
  ASSERT_TRUE(service.load("tap_1d").ok());
  using R = v1::StartIdentificationRequest;
  struct Case {
    std::function<void(R&)> ask;
    std::string parameter;
    double expected, tolerance;
  };
  for (const Case& one : std::vector<Case>{
           {[](R& r) {
              r.mutable_friction()->set_tip("rod");
              r.set_object("mine");
            },
            "kinetic", 0.8, 0.1},
           {[](R& r) { r.mutable_structural_stiffness()->set_constant(true); },
            "structural_stiffness_n_per_mm", 2.537, 0.03},
           {[](R& r) { r.mutable_tool(); }, "mass_g", 12.59, 0.13},
           {[](R& r) { r.mutable_threshold(); }, "threshold_n", 0.05, 0.04},
           {[](R& r) { r.mutable_gains(); }, "proportional_gain", 1.0, 1.0},
       }) {
    R request;
    one.ask(request);
    request.set_time_limit_s(300.0);
    request.set_adopt(true);
    const v1::IdentificationProgress end = service.end_of(request);
    EXPECT_EQ(end.state(), v1::IDENTIFICATION_STATE_CONVERGED) << end.ShortDebugString().substr(0, 3000);
    EXPECT_NEAR(parameter_of(end, one.parameter).value(), one.expected, one.tolerance) << end.kind();
    EXPECT_EQ(service.state().scene(), "tap_1d") << end.kind() << ": " << end.problem().ShortDebugString();
    RecordProperty(end.kind() + "_s", std::to_string(end.duration_s()));
  }
}

TEST(ServiceIdentification, WhileOneRunsNothingElseTouchesTheRig) {
  const Identifying service(touching("rubber_ball_3d", true));
  ASSERT_TRUE(service.load("tap_1d").ok());
  std::string id;
  ASSERT_TRUE(service.start(contact("mine"), &id).ok());
  const std::string who = "identification '" + id + "' is under way";
  const auto refused = [&](const grpc::Status& status) {
    expect_refused_saying(status, grpc::StatusCode::FAILED_PRECONDITION, who);
  };
  refused(service.load("tap_1d"));
  v1::SetTargetRequest target;
  target.set_stiffness_n_per_mm(1.0);
  refused(service.set_target(target));
  v1::UnloadSceneResponse unloaded;
  refused(service.scene->UnloadScene(call_context().get(), {}, &unloaded));
  v1::SetHandProgramRequest hand;
  hand.mutable_program()->set_kind(v1::HAND_PROGRAM_KIND_REST);
  v1::SetHandProgramResponse done;
  refused(service.simulation->SetHandProgram(call_context().get(), hand, &done));
  v1::SetObjectRequest object;
  object.set_name("wood_plate");
  v1::SetObjectResponse put;
  refused(service.simulation->SetObject(call_context().get(), object, &put));
  expect_refused_saying(service.start(contact("other")), grpc::StatusCode::FAILED_PRECONDITION,
                        "another identification is under way");

  // A client that leaves changes nothing; another one cancels.
  service.watch(id, [](const v1::IdentificationProgress& p) { return p.duration_s() > 0.2; });
  EXPECT_EQ(
      service.watch(id, [](const v1::IdentificationProgress& p) { return p.duration_s() > 0.4; }).state(),
      v1::IDENTIFICATION_STATE_RUNNING);
  v1::IdentificationProgress end;
  ASSERT_TRUE(service.cancel(&end).ok());
  EXPECT_EQ(end.state(), v1::IDENTIFICATION_STATE_CANCELLED);
  EXPECT_EQ(service.state().scene(), "tap_1d") << "what was loaded before is back";
  EXPECT_TRUE(service.load("tap_1d").ok());
  ASSERT_TRUE(service.cancel(&end).ok()) << "over is over";
  EXPECT_EQ(end.state(), v1::IDENTIFICATION_STATE_CANCELLED);
}

TEST(ServiceIdentification, AStopEndsItAndALatchedGuardRefusesIt) {
  const Identifying service(touching("rubber_ball_3d", true));
  ASSERT_TRUE(service.start(contact("mine")).ok());
  ASSERT_TRUE(service.stop().ok());
  const v1::IdentificationProgress end = service.watch();
  EXPECT_EQ(end.state(), v1::IDENTIFICATION_STATE_FAILED);
  EXPECT_EQ(end.problem().what(), "the guard latched");
  expect_refused_saying(service.start(contact("mine")), grpc::StatusCode::FAILED_PRECONDITION,
                        "the guard is latched");
}

TEST(ServiceIdentification, TheTargetThatWasInForceComesBackWithTheScene) {
  const Identifying service(touching("rubber_ball_3d"));
  ASSERT_TRUE(service.load("tap_1d").ok());
  v1::SetTargetRequest target;
  target.set_stiffness_n_per_mm(0.31);
  ASSERT_TRUE(service.set_target(target).ok());
  v1::StartIdentificationRequest request = contact("mine");
  request.set_time_limit_s(1.0);
  const v1::IdentificationProgress result = service.end_of(request);
  EXPECT_NE(result.state(), v1::IDENTIFICATION_STATE_RUNNING);
  const v1::RigState state =
      service.await([](const v1::RigState& s) { return s.scene() == "tap_1d" && !s.in_contact(); });
  EXPECT_DOUBLE_EQ(state.target_stiffness_n_per_mm(), 0.31) << "not the scene's own 0.5";
}

TEST(ServiceIdentification, TheTimeLimitFollowsTheKindUnlessItIsGiven) {
  const Identifying service(touching("rubber_ball_3d"));
  const auto limit_s = [&service](const v1::StartIdentificationRequest& request) {
    std::string id;
    EXPECT_TRUE(service.start(request, &id).ok());
    v1::IdentificationProgress end;
    EXPECT_TRUE(service.cancel(&end).ok());
    return end.time_limit_s();
  };
  v1::StartIdentificationRequest request = contact("mine");
  EXPECT_EQ(limit_s(request), 120.0);
  request.set_time_limit_s(33.0);
  EXPECT_EQ(limit_s(request), 33.0);
  v1::StartIdentificationRequest tool;
  tool.mutable_tool();
  EXPECT_EQ(limit_s(tool), 60.0);
}

TEST(ServiceIdentification, WhatWasGatheredInTooShortATimeIsKeptAsPartial) {
  const Identifying service(touching("rubber_ball_3d"));
  v1::StartIdentificationRequest request = contact("mine");
  request.set_time_limit_s(5.0);
  request.set_adopt(true);
  const v1::IdentificationProgress end = service.end_of(request);
  EXPECT_EQ(end.state(), v1::IDENTIFICATION_STATE_PARTIAL) << end.ShortDebugString().substr(0, 2000);
  EXPECT_NEAR(end.duration_s(), 5.0, 0.1);
  EXPECT_GT(end.missing_size(), 0);
  ASSERT_FALSE(end.model().empty());
  const v1::StoredModel stored = service.stored(end.model());
  EXPECT_FALSE(stored.converged());
  EXPECT_EQ(stored.tags_size(), 0) << "only what converged is adopted";
}

TEST(ServiceIdentification, ARequestThatMakesNoSenseIsRefusedByItsField) {
  const Identifying service(touching("rubber_ball_3d", true));
  struct Case {
    std::function<void(v1::StartIdentificationRequest&)> spoil;
    grpc::StatusCode code;
    std::string where;
  };
  using R = v1::StartIdentificationRequest;
  using enum grpc::StatusCode;
  const std::vector<Case> cases{
      {[](R& r) { r.clear_contact(); }, INVALID_ARGUMENT, ""},
      {[](R& r) { r.set_object(""); }, INVALID_ARGUMENT, ".object"},
      {[](R& r) { r.set_object("../etc"); }, INVALID_ARGUMENT, ".object"},
      {[](R& r) { r.mutable_tool(); }, INVALID_ARGUMENT, ".object"},
      {[](R& r) { r.set_time_limit_s(kNaN); }, INVALID_ARGUMENT, ".time_limit_s"},
      {[](R& r) { r.set_time_limit_s(1e9); }, OUT_OF_RANGE, ".time_limit_s"},
      {[](R& r) { r.mutable_contact()->set_force_n(1e3); }, OUT_OF_RANGE, ".contact.force_n"},
      {[](R& r) { r.mutable_contact()->set_force_n(kNaN); }, INVALID_ARGUMENT, ".contact.force_n"},
      {[](R& r) { r.mutable_friction()->set_tip("feather"); }, INVALID_ARGUMENT, ".friction.tip"},
      {[](R& r) { r.set_recording("recording-9"); }, NOT_FOUND, ".recording"},
      {[](R& r) {
         r.mutable_gains();
         r.set_object("");
         r.set_recording("recording-9");
       },
       INVALID_ARGUMENT, ".recording"},
  };
  for (const Case& one : cases) {
    R request = contact("mine");
    one.spoil(request);
    expect_refused(service.start(request), one.code, "StartIdentificationRequest" + one.where);
  }
  v1::ListIdentificationsResponse list;
  ASSERT_TRUE(service.stub->ListIdentifications(call_context().get(), {}, &list).ok());
  EXPECT_EQ(list.identifications_size(), 0);
  v1::WatchIdentificationRequest watch;
  const auto context = call_context();
  const auto reader = service.stub->WatchIdentification(context.get(), watch);
  v1::IdentificationProgress none;
  EXPECT_FALSE(reader->Read(&none));
  EXPECT_EQ(reader->Finish().error_code(), grpc::StatusCode::NOT_FOUND);
}

TEST(ServiceIdentification, ARecordingIsUploadedAndIdentified) {
  const Identifying service(touching("rubber_ball_3d", true));
  v1::UploadRecordingResponse uploaded;
  v1::RecordingDescription description;
  description.set_name("presses.csv");
  ASSERT_TRUE(service.upload(pressed(0.2, 1.5, 2e-3), &uploaded, description).ok());
  EXPECT_EQ(uploaded.rows(), 6000U);
  EXPECT_NEAR(uploaded.duration_s(), 29.995, 1e-6);
  EXPECT_EQ(uploaded.sha256().size(), 64U);
  v1::StartIdentificationRequest request = contact("formula");
  request.mutable_contact()->set_law(v1::CONTACT_LAW_HUNT_CROSSLEY);
  request.set_recording(uploaded.recording());
  const v1::IdentificationProgress end = service.end_of(request);
  ASSERT_FALSE(end.model().empty()) << end.ShortDebugString().substr(0, 3000);
  EXPECT_NEAR(parameter_of(end, "exponent").value(), 1.5, 0.03);
  EXPECT_NEAR(parameter_of(end, "stiffness_n_per_mm_m").value(), 0.2, 0.01);
  const v1::StoredModel stored = service.stored(end.model());
  EXPECT_NE(stored.data_reference().find("presses.csv"), std::string::npos);
  EXPECT_NE(stored.data_reference().find(uploaded.sha256()), std::string::npos);
}

TEST(ServiceIdentification, WhatCannotBeReadIsRefusedWithItsLineAndColumn) {
  const Identifying service(touching("rubber_ball_3d", true));
  const auto refusal_of = [&](const std::string& csv) {
    v1::UploadRecordingResponse uploaded;
    v1::RecordingDescription description;
    description.set_name("bad.csv");
    grpc::Status status = service.upload(csv, &uploaded, description);
    if (!status.ok()) return status;
    EXPECT_GT(uploaded.remarks_size(), 0) << "the upload shows already";
    v1::StartIdentificationRequest request = contact("mine");
    request.set_recording(uploaded.recording());
    return service.start(request);
  };
  std::string rows;
  for (int i = 0; i < 20; ++i) rows += std::to_string(0.1 * i) + ",1,1\n";
  const std::string head = "time_s,force_N,indentation_mm\n";
  struct Case {
    std::string csv, where;
  };
  for (const Case& one :
       std::vector<Case>{{"", "bad.csv"},
                         {head + rows + "2.5,nan,1\n", "bad.csv', line 22, column 'force_N'"},
                         {"a,b,c\n" + rows, "bad.csv"}}) {
    const grpc::Status status = refusal_of(one.csv);
    EXPECT_EQ(status.error_code(), grpc::StatusCode::INVALID_ARGUMENT) << one.csv.substr(0, 60);
    EXPECT_NE(detail_of(status).where().find(one.where), std::string::npos) << status.error_message();
  }
  EXPECT_TRUE(service.state().loop().running());
}

TEST(ServiceIdentification, OldRecordingsMakeRoomAndHalfAnUploadLeavesNothing) {
  const Identifying service(touching("rubber_ball_3d", true));
  const std::string csv = pressed(0.2, 1.5, 0.0);
  v1::UploadRecordingResponse first;
  ASSERT_TRUE(service.upload(csv, &first).ok());
  {
    v1::UploadRecordingResponse never;
    const auto context = call_context();
    const auto writer = service.stub->UploadRecording(context.get(), &never);
    v1::UploadRecordingRequest piece;
    piece.mutable_description()->set_name("half");
    piece.set_csv(csv.substr(0, 500));
    ASSERT_TRUE(writer->Write(piece));
    context->TryCancel();
    EXPECT_EQ(writer->Finish().error_code(), grpc::StatusCode::CANCELLED);
  }
  v1::UploadRecordingResponse last;
  for (int i = 0; i < 8; ++i) ASSERT_TRUE(service.upload(csv, &last).ok());
  v1::StartIdentificationRequest request = contact("mine");
  request.set_recording(first.recording());
  EXPECT_EQ(service.start(request).error_code(), grpc::StatusCode::NOT_FOUND);
  request.set_recording(last.recording());
  EXPECT_TRUE(service.start(request).ok());
}

TEST(ServiceIdentification, TheNextRunOfTheDaemonRemembersWhatEnded) {
  const TemporaryFolder folder;
  server::DaemonConfig config = touching("rubber_ball_3d", true);
  config.model_store = folder.path() + "/models.sqlite";
  std::string id;
  {
    const Identifying service(config);
    ASSERT_TRUE(service.start(contact("mine"), &id).ok());
    ASSERT_TRUE(service.cancel().ok());
  }
  const Identifying service(config);
  v1::ListIdentificationsResponse list;
  ASSERT_TRUE(service.stub->ListIdentifications(call_context().get(), {}, &list).ok());
  ASSERT_EQ(list.identifications_size(), 1);
  EXPECT_EQ(list.identifications(0).identification(), id);
  const v1::IdentificationProgress& earlier = list.identifications(0);
  EXPECT_EQ(earlier.state(), v1::IDENTIFICATION_STATE_CANCELLED);
  // Figures that are not kept are absent; they are not 0.
  EXPECT_FALSE(earlier.has_duration_s() || earlier.has_time_limit_s() || earlier.has_samples());
  EXPECT_FALSE(earlier.has_completion() || earlier.has_steady() || earlier.has_certain());
  EXPECT_FALSE(earlier.has_residual());
  std::string next;
  ASSERT_TRUE(service.start(contact("mine"), &next).ok());
  EXPECT_EQ(next, "contact-2");
}

TEST(ServiceIdentification, TheDaemonEndsWhileOneRuns) {
  auto service = std::make_unique<Identifying>(touching("rubber_ball_3d", true));
  ASSERT_TRUE(service->start(contact("mine")).ok());
  service.reset();  // returns, and says nothing to a sanitizer
}

}  // namespace
}  // namespace hapticd::test
