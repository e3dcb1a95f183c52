#pragma once

#include <grpcpp/support/status.h>
#include <gtest/gtest.h>

#include <string>

#include "hapticd/v1/common.pb.h"

namespace hapticd::test {

/// Detail (hapticd.v1.ErrorDetail) inside a status; empty if there is none. Fails the test when the
/// google.rpc.Status around it contradicts the status.
v1::ErrorDetail detail_of(const grpc::Status& status);

/// All five parts, word for word.
struct Expected {
  grpc::StatusCode code;
  std::string what;
  std::string where;
  std::string value;
  std::string limit;
  std::string remedy;
};
void expect_refused(const grpc::Status& status, const Expected& expected);
/// The code that a program branches on, and the place.
void expect_refused(const grpc::Status& status, grpc::StatusCode code, const std::string& where);
void expect_refused(const grpc::Status& status, grpc::StatusCode code, v1::ErrorReason reason,
                    const std::string& where);
void expect_refused_for(const grpc::Status& status, grpc::StatusCode code, v1::ErrorReason reason);
void expect_refused_saying(const grpc::Status& status, grpc::StatusCode code, const std::string& what);

}  // namespace hapticd::test
