#include "tests/integration/error_detail.h"

#include <google/protobuf/any.pb.h>
#include <google/protobuf/unknown_field_set.h>

namespace hapticd::test {

v1::ErrorDetail detail_of(const grpc::Status& status) {
  v1::ErrorDetail detail;
  if (status.error_details().empty()) return detail;
  google::protobuf::UnknownFieldSet fields;  // google.rpc.Status {1: code, 2: message, 3: details}
  EXPECT_TRUE(fields.ParseFromString(status.error_details()));
  for (int i = 0; i < fields.field_count(); ++i) {
    const google::protobuf::UnknownField& field = fields.field(i);
    if (field.number() == 1) {
      EXPECT_EQ(field.varint(), static_cast<std::uint64_t>(status.error_code()));
    }
    if (field.number() == 2) {
      EXPECT_EQ(field.length_delimited(), status.error_message());
    }
    if (field.number() == 3) {
      google::protobuf::Any any;
      EXPECT_TRUE(any.ParseFromString(field.length_delimited()));
      EXPECT_TRUE(any.UnpackTo(&detail)) << any.type_url();
    }
  }
  return detail;
}

void expect_refused(const grpc::Status& status, const Expected& expected) {
  EXPECT_EQ(status.error_code(), expected.code) << status.error_message();
  const v1::ErrorDetail detail = detail_of(status);
  EXPECT_EQ(detail.what(), expected.what);
  EXPECT_EQ(detail.where(), expected.where);
  EXPECT_EQ(detail.value(), expected.value);
  EXPECT_EQ(detail.limit(), expected.limit);
  EXPECT_EQ(detail.remedy(), expected.remedy);
}

void expect_refused(const grpc::Status& status, grpc::StatusCode code, const std::string& where) {
  EXPECT_EQ(status.error_code(), code) << status.error_message();
  EXPECT_EQ(detail_of(status).where(), where) << status.error_message();
}

void expect_refused(const grpc::Status& status, grpc::StatusCode code, v1::ErrorReason reason,
                    const std::string& where) {
  expect_refused(status, code, where);
  EXPECT_EQ(detail_of(status).reason(), reason) << status.error_message();
}

void expect_refused_for(const grpc::Status& status, grpc::StatusCode code, v1::ErrorReason reason) {
  EXPECT_EQ(status.error_code(), code) << status.error_message();
  EXPECT_EQ(detail_of(status).reason(), reason) << status.error_message();
}

void expect_refused_saying(const grpc::Status& status, grpc::StatusCode code, const std::string& what) {
  EXPECT_EQ(status.error_code(), code) << status.error_message();
  EXPECT_EQ(detail_of(status).what(), what);
}

}  // namespace hapticd::test
