#include <gtest/gtest.h>

#include <chrono>
#include <cmath>
#include <memory>
#include <string>

#include "hapticd/v1/guide.grpc.pb.h"
#include "hapticd/v1/presentation.grpc.pb.h"
#include "tests/integration/error_detail.h"
#include "tests/integration/running_service.h"

namespace hapticd::test {
namespace {

class ServiceGuide : public testing::Test {
 protected:
  ServiceGuide()
      : guide(v1::GuideService::NewStub(service.channel)),
        presentation(v1::PresentationService::NewStub(service.channel)) {}

  /// Moves to the end.
  grpc::Status move(const v1::MoveToolRequest& request, v1::GuideStatus* last = nullptr) {
    const auto context = call_context();
    v1::GuideStatus unused;
    return read_all(*guide->MoveTool(context.get(), request), last != nullptr ? *last : unused);
  }
  static v1::MoveToolRequest to(double x_mm, double y_mm, double z_mm) {
    v1::MoveToolRequest request;
    request.mutable_point_mm()->set_x(x_mm);
    request.mutable_point_mm()->set_y(y_mm);
    request.mutable_point_mm()->set_z(z_mm);
    request.set_max_speed_mm_per_s(60.0);
    return request;
  }

  RunningService service;
  std::unique_ptr<v1::GuideService::Stub> guide;
  std::unique_ptr<v1::PresentationService::Stub> presentation;
};

TEST_F(ServiceGuide, LeadsTheToolToAPointAndThenToAnObject) {
  service.load("press_guided");
  service.set_hand(v1::HAND_PROGRAM_KIND_FOLLOW);
  v1::GuideStatus last;
  ASSERT_TRUE(ok(move(to(0.0, 0.0, 20.0), &last)));
  EXPECT_EQ(last.state(), v1::GUIDE_STATE_ARRIVED);
  EXPECT_NEAR(last.position_mm().z(), 20.0, 1.5);

  v1::MoveToolRequest down;
  down.set_until_contact_mm(50.0);
  ASSERT_TRUE(ok(move(down, &last)));
  EXPECT_EQ(last.state(), v1::GUIDE_STATE_CONTACT);
  EXPECT_EQ(last.number(), 2U);
  EXPECT_NEAR(last.position_mm().z(), 0.0, 2.0);
  // In contact already.
  expect_refused_for(move(down), grpc::StatusCode::FAILED_PRECONDITION, v1::ERROR_REASON_IN_CONTACT);
}

TEST_F(ServiceGuide, RefusesWhatIsNoMotionAndSaysWhy) {
  const auto refused = [this](const v1::MoveToolRequest& request, grpc::StatusCode code, const char* word) {
    const grpc::Status status = move(request);
    EXPECT_EQ(status.error_code(), code) << status.error_message();
    EXPECT_NE(status.error_message().find(word), std::string::npos) << status.error_message();
  };
  refused({}, grpc::StatusCode::INVALID_ARGUMENT, "destination");
  refused(to(0.0, 0.0, 5000.0), grpc::StatusCode::OUT_OF_RANGE, "point_mm");
  refused(to(0.0, std::nan(""), 0.0), grpc::StatusCode::INVALID_ARGUMENT, "point_mm");
  v1::MoveToolRequest fast = to(0.0, 0.0, 20.0);
  fast.set_max_speed_mm_per_s(500.0);
  refused(fast, grpc::StatusCode::OUT_OF_RANGE, "100 mm/s");
  v1::MoveToolRequest hard = to(0.0, 0.0, 20.0);
  hard.set_max_force_n(40.0);
  refused(hard, grpc::StatusCode::OUT_OF_RANGE, "4 N");
  v1::MoveToolRequest down;
  down.set_until_contact_mm(50.0);
  refused(down, grpc::StatusCode::FAILED_PRECONDITION, "no scene");
  v1::MoveToolRequest station;
  station.set_above_station("sponge");
  refused(station, grpc::StatusCode::FAILED_PRECONDITION, "turntable");
}

TEST_F(ServiceGuide, AMotionEndsWithItsClientAndWithAStop) {
  service.set_hand(v1::HAND_PROGRAM_KIND_FOLLOW);
  v1::MoveToolRequest slow = to(0.0, 0.0, 60.0);
  slow.set_max_speed_mm_per_s(5.0);
  v1::GuideStatus status;
  {
    auto context = call_context();
    auto reader = guide->MoveTool(context.get(), slow);
    ASSERT_TRUE(reader->Read(&status));
    // One at a time.
    const grpc::Status second = move(to(0.0, 0.0, 20.0));
    EXPECT_EQ(detail_of(second).reason(), v1::ERROR_REASON_BUSY) << second.error_message();
    context->TryCancel();
    reader->Finish();
  }
  // It lets go, and the next one begins.
  const auto until = std::chrono::steady_clock::now() + std::chrono::seconds(5);
  for (bool begun = false; !begun && std::chrono::steady_clock::now() < until;) {
    auto context = call_context();
    auto reader = guide->MoveTool(context.get(), slow);
    begun = reader->Read(&status);
    if (begun) {
      EXPECT_EQ(status.number(), 2U);
      service.stop();
    }
    const grpc::Status end = read_all(*reader, status);
    EXPECT_EQ(end.error_code(), begun ? grpc::StatusCode::ABORTED : grpc::StatusCode::FAILED_PRECONDITION);
  }
  EXPECT_EQ(status.state(), v1::GUIDE_STATE_FORCE_CUT);
  const grpc::Status latched = move(slow);
  EXPECT_EQ(detail_of(latched).reason(), v1::ERROR_REASON_GUARD_LATCHED) << latched.error_message();
}

TEST_F(ServiceGuide, APressIsJudged) {
  v1::BeginPresentationResponse begun;
  v1::PresentationSummary summary;
  grpc::Status status = presentation->BeginPresentation(call_context().get(), {}, &begun);
  EXPECT_EQ(detail_of(status).reason(), v1::ERROR_REASON_NOT_IN_THIS_SCENE) << status.error_message();

  service.load("press_guided");
  status = presentation->EndPresentation(call_context().get(), {}, &summary);
  EXPECT_EQ(detail_of(status).reason(), v1::ERROR_REASON_NOT_IN_THIS_SCENE) << status.error_message();
  ASSERT_TRUE(ok(presentation->BeginPresentation(call_context().get(), {}, &begun)));
  EXPECT_EQ(begun.number(), 1U);
  ASSERT_TRUE(ok(presentation->EndPresentation(call_context().get(), {}, &summary)));
  EXPECT_EQ(summary.number(), 1U);
  ASSERT_EQ(summary.flaws_size(), 1);
  EXPECT_EQ(summary.flaws(0), v1::PRESENTATION_FLAW_NO_CONTACT);

  ASSERT_TRUE(ok(presentation->BeginPresentation(call_context().get(), {}, &begun)));
  service.press(2.0, [](const v1::RigState& state) { return state.displacement_mm() > 3.0; });
  ASSERT_TRUE(ok(presentation->EndPresentation(call_context().get(), {}, &summary)));
  // A machine that stalls loses ticks; nothing else is wrong.
  for (const int flaw : summary.flaws()) EXPECT_EQ(flaw, v1::PRESENTATION_FLAW_TICKS_LOST);
  EXPECT_GE(summary.contacts(), 1U);
  EXPECT_GT(summary.peak_displacement_mm(), 3.0);
  EXPECT_GE(summary.begin_tick(), begun.begin_tick());
}

}  // namespace
}  // namespace hapticd::test
