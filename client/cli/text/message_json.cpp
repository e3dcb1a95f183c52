#include "client/cli/text/message_json.h"

#include <cmath>

#include "client/cli/text/names.h"

namespace hapticd::cli {
namespace {

using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

Json single(const Message& message, const FieldDescriptor& field) {
  const auto& access = *message.GetReflection();
  switch (field.cpp_type()) {
    case FieldDescriptor::CPPTYPE_INT32:
      return access.GetInt32(message, &field);
    case FieldDescriptor::CPPTYPE_INT64:
      return access.GetInt64(message, &field);
    case FieldDescriptor::CPPTYPE_UINT32:
      if (field.name().ends_with("_bits")) return bit_words(field.name(), access.GetUInt32(message, &field));
      return access.GetUInt32(message, &field);
    case FieldDescriptor::CPPTYPE_UINT64:
      return access.GetUInt64(message, &field);
    case FieldDescriptor::CPPTYPE_DOUBLE:
      return json_number(access.GetDouble(message, &field));
    case FieldDescriptor::CPPTYPE_FLOAT:
      return json_number(static_cast<double>(access.GetFloat(message, &field)));
    case FieldDescriptor::CPPTYPE_BOOL:
      return access.GetBool(message, &field);
    case FieldDescriptor::CPPTYPE_ENUM:
      return enum_word(*field.enum_type(), access.GetEnumValue(message, &field));
    case FieldDescriptor::CPPTYPE_STRING:
      return access.GetString(message, &field);
    case FieldDescriptor::CPPTYPE_MESSAGE:
      return to_json(access.GetMessage(message, &field));
  }
  return nullptr;
}

/// The contract repeats only texts, messages and enumerations.
Json repeated(const Message& message, const FieldDescriptor& field) {
  const auto& access = *message.GetReflection();
  Json list = Json::array();
  for (int i = 0; i < access.FieldSize(message, &field); ++i) {
    if (field.cpp_type() == FieldDescriptor::CPPTYPE_MESSAGE) {
      list.push_back(to_json(access.GetRepeatedMessage(message, &field, i)));
    } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_ENUM) {
      list.push_back(enum_word(*field.enum_type(), access.GetRepeatedEnumValue(message, &field, i)));
    } else if (field.cpp_type() == FieldDescriptor::CPPTYPE_STRING) {
      list.push_back(access.GetRepeatedString(message, &field, i));
    }
  }
  return list;
}

}  // namespace

Json json_number(double value) {
  if (std::isnan(value)) return "NaN";
  if (std::isinf(value)) return value > 0 ? "Infinity" : "-Infinity";
  return value;
}

Json to_json(const Message& message) {
  Json object = Json::object();
  const auto& type = *message.GetDescriptor();
  for (int i = 0; i < type.field_count(); ++i) {
    const FieldDescriptor& field = *type.field(i);
    if (field.is_repeated()) {
      object[field.name()] = repeated(message, field);
    } else if (!field.has_presence() || message.GetReflection()->HasField(message, &field)) {
      object[field.name()] = single(message, field);
    }
  }
  return object;
}

}  // namespace hapticd::cli
