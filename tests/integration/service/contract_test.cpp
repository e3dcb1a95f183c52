// What programs rely on beyond the messages: numbers of bits, reasons they can branch on.

#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <set>

#include "hal/samples.h"
#include "hapticd/v1/common.pb.h"
#include "hapticd/v1/telemetry.pb.h"
#include "rt/record/tick_record.h"
#include "server/grpc/messages/status.h"
#include "tests/integration/error_detail.h"

namespace hapticd::test {
namespace {

TEST(Contract, TheBitsOfASampleAreThoseOfTheDrivers) {
  namespace status = hal::sample_status;
  EXPECT_EQ(v1::SAMPLE_STATUS_BIT_FORCE_MISSING, status::kForceMissing);
  EXPECT_EQ(v1::SAMPLE_STATUS_BIT_FORCE_SATURATED, status::kForceSaturated);
  EXPECT_EQ(v1::SAMPLE_STATUS_BIT_FORCE_FAULT, status::kForceFault);
  EXPECT_EQ(v1::SAMPLE_STATUS_BIT_DEVICE_FAULT, status::kDeviceFault);
  EXPECT_EQ(v1::SAMPLE_STATUS_BIT_FORCE_LOST, status::kForceLost);
  EXPECT_EQ(v1::SAMPLE_STATUS_BIT_FORCE_WARNING, status::kForceWarning);
  EXPECT_EQ(v1::SAMPLE_STATUS_BIT_DEVICE_NOT_READY, status::kDeviceNotReady);
  EXPECT_EQ(v1::SAMPLE_STATUS_BIT_DEVICE_WARM, status::kDeviceWarm);
  EXPECT_EQ(v1::SAMPLE_STATUS_BIT_DEVICE_OVER_FORCE, status::kDeviceOverForce);
  EXPECT_EQ(v1::SAMPLE_STATUS_BIT_DEVICE_OVER_SPEED, status::kDeviceOverSpeed);
  EXPECT_EQ(v1::SAMPLE_STATUS_BIT_COMMAND_STALE, status::kCommandStale);
}

TEST(Contract, TheBitsOfTheGuardAreItsLimits) {
  EXPECT_EQ(v1::GUARD_LIMIT_BIT_FORCE, rt::guard_limit::kForce);
  EXPECT_EQ(v1::GUARD_LIMIT_BIT_RATE, rt::guard_limit::kRate);
  EXPECT_EQ(v1::GUARD_LIMIT_BIT_POWER, rt::guard_limit::kPower);
  EXPECT_EQ(v1::GUARD_LIMIT_BIT_POSE, rt::guard_limit::kPose);
  EXPECT_EQ(v1::GUARD_LIMIT_BIT_FREE_AIR, rt::guard_limit::kFreeAir);
}

TEST(Contract, EveryKindOfRefusalHasAReasonOfItsOwn) {
  std::set<v1::ErrorReason> reasons;
  for (int kind = 0; kind <= static_cast<int>(server::RefusalKind::kInternal); ++kind) {
    const v1::ErrorDetail detail =
        detail_of(server::to_status({static_cast<server::RefusalKind>(kind), {"no", "", "", "", ""}}));
    EXPECT_NE(detail.reason(), v1::ERROR_REASON_UNSPECIFIED) << kind;
    EXPECT_TRUE(reasons.insert(detail.reason()).second) << kind;
  }
  for (int reason = 1; reason <= static_cast<int>(server::Reason::kLeaseLost); ++reason) {
    const v1::ErrorDetail detail = detail_of(server::to_status({server::RefusalKind::kFailedPrecondition,
                                                                {"no", "", "", "", ""},
                                                                static_cast<server::Reason>(reason)}));
    EXPECT_TRUE(reasons.insert(detail.reason()).second) << reason;
  }
  for (int code = 1; code < static_cast<int>(hal::ErrorCode::kOutOfRange); ++code) {
    hal::Error error{"no", "", "", "", ""};
    error.code = static_cast<hal::ErrorCode>(code);
    EXPECT_TRUE(reasons.insert(server::to_detail(error).reason()).second) << code;
  }
  EXPECT_EQ(static_cast<int>(reasons.size()) + 1, v1::ErrorReason_descriptor()->value_count())
      << "a reason that no refusal has";
}

}  // namespace
}  // namespace hapticd::test
