#include "client/cpp/error.h"

#include <google/protobuf/any.pb.h>
#include <gtest/gtest.h>

#include <string>

namespace hapticd::client {
namespace {

/// A field of type bytes with a number below 16, as protobuf writes it.
std::string length_delimited(int field, const std::string& bytes) {
  std::string text(1, static_cast<char>(field << 3 | 2));
  std::size_t length = bytes.size();
  for (; length > 127; length >>= 7U) text += static_cast<char>(length % 128 + 128);
  return text + static_cast<char>(length) + bytes;
}

/// A google.rpc.Status with one detail, written by hand: code = 1, message = 2, details = 3.
std::string status_with(const google::protobuf::Message& detail) {
  google::protobuf::Any any;
  any.PackFrom(detail);
  return std::string("\x08\x03", 2) + length_delimited(2, "refused") +
         length_delimited(3, any.SerializeAsString());
}

TEST(Error, DecodesTheDetailOfARefusal) {
  v1::ErrorDetail sent;
  sent.set_what("target stiffness is not finite");
  sent.set_where("SetTargetRequest.stiffness_n_per_mm");
  sent.set_value("nan");
  sent.set_limit("0 … 1000 N/mm");
  sent.set_remedy("give a number");
  const Error error = error_from_status(3, "refused", status_with(sent), "127.0.0.1:1");
  EXPECT_EQ(error.kind(), ErrorKind::kRefused);
  EXPECT_EQ(error.code(), "INVALID_ARGUMENT");
  EXPECT_EQ(error.detail().SerializeAsString(), sent.SerializeAsString());
  EXPECT_STREQ(error.what(),
               "SetTargetRequest.stiffness_n_per_mm: target stiffness is not finite (got nan); accepted: "
               "0 … 1000 N/mm; give a number");
}

TEST(Error, KeepsTheMessageOfARefusalWithoutDetail) {
  const Error error = error_from_status(9, "no scene is loaded", "", "127.0.0.1:1");
  EXPECT_EQ(error.kind(), ErrorKind::kRefused);
  EXPECT_EQ(error.code(), "FAILED_PRECONDITION");
  EXPECT_EQ(error.detail().what(), "no scene is loaded");
}

TEST(Error, SaysWhoEndedACallThatIsCancelled) {
  const Error error = error_from_status(1, "CANCELLED", "", "127.0.0.1:1");
  EXPECT_EQ(error.kind(), ErrorKind::kRefused);
  EXPECT_STREQ(
      error.what(),
      "127.0.0.1:1: the daemon ended the call before its answer; see whether hapticd still runs there");
}

TEST(Error, SurvivesMalformedDetails) {
  v1::Vector3 foreign;
  foreign.set_x(1.0);
  EXPECT_EQ(error_from_status(3, "message", status_with(foreign), "").detail().what(), "message");
  EXPECT_EQ(error_from_status(3, "message", "\xff\xff not protobuf", "").detail().what(), "message");
}

TEST(Error, DistinguishesADeadDaemonFromOneThatExplainsItself) {
  EXPECT_EQ(error_from_status(14, "Socket closed", "", "h:1").kind(), ErrorKind::kUnreachable);
  EXPECT_EQ(error_from_status(4, "Deadline Exceeded", "", "h:1").kind(), ErrorKind::kTimedOut);
  EXPECT_EQ(error_from_status(14, "Socket closed", "", "h:1").detail().where(), "h:1");
  v1::ErrorDetail sent;
  sent.set_what("the loop did not take the command in time");
  EXPECT_EQ(error_from_status(4, "", status_with(sent), "h:1").kind(), ErrorKind::kRefused);
}

TEST(Error, ADaemonThatIsOlderThanTheCallIsReported) {
  const Error error = error_from_status(12, "", "", "h:1");
  EXPECT_EQ(error.kind(), ErrorKind::kRefused);
  EXPECT_EQ(error.detail().what(), "the daemon does not know this call");
  EXPECT_NE(error.detail().remedy(), "");
}

TEST(Error, NamesEveryStatus) {
  EXPECT_EQ(status_code_name(0), "OK");
  EXPECT_EQ(status_code_name(16), "UNAUTHENTICATED");
  EXPECT_EQ(status_code_name(17), "UNKNOWN");
  EXPECT_EQ(status_code_name(-1), "UNKNOWN");
}

}  // namespace
}  // namespace hapticd::client
