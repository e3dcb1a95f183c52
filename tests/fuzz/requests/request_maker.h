#pragma once

#include <google/protobuf/dynamic_message.h>

#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <memory>
#include <random>
#include <string>
#include <vector>

namespace hapticd::fuzz {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;
using google::protobuf::Message;

/// Requests by a seed.
class RequestMaker {
 public:
  explicit RequestMaker(std::uint64_t seed) : random_(seed) {}

  std::size_t below(std::size_t n) { return std::uniform_int_distribution<std::size_t>(0, n - 1)(random_); }
  bool chance(double share) { return std::uniform_real_distribution<double>(0.0, 1.0)(random_) < share; }

  /// The bytes of a request; mostly a message of its type, sometimes not.
  std::string make(const Descriptor& type) {
    const std::unique_ptr<Message> message(
        google::protobuf::MessageFactory::generated_factory()->GetPrototype(&type)->New());
    fill(*message, 0);
    std::string bytes = message->SerializeAsString();
    if (chance(0.15)) spoil(bytes);
    if (chance(0.003)) bytes.append(std::size_t{3} << 20U, '\x0a');
    return bytes;
  }

 private:
  static constexpr int kMaxDepth = 4;

  double number() {
    constexpr double kInfinity = std::numeric_limits<double>::infinity();
    constexpr double kNumbers[] = {0.0,        -0.0, 1.0,   -1.0,  0.3,    5.0,      100.0,
                                   1e3,        -1e3, 1e-9,  1e308, -1e308, 5e-324,   kInfinity,
                                   -kInfinity, NAN,  0.001, 20.0,  1e18,   1.0000001};
    return kNumbers[below(std::size(kNumbers))];
  }
  std::int64_t integer() {
    constexpr std::int64_t kIntegers[] = {0,
                                          1,
                                          -1,
                                          2,
                                          7,
                                          16,
                                          100,
                                          1000,
                                          65536,
                                          2147483647,
                                          -2147483648LL,
                                          std::numeric_limits<std::int64_t>::max(),
                                          std::numeric_limits<std::int64_t>::min(),
                                          5'000'000'000};
    return kIntegers[below(std::size(kIntegers))];
  }
  std::string text() {
    static const std::vector<std::string> kTexts{"",
                                                 "tap_1d",
                                                 "explore_rod",
                                                 "wall",
                                                 "sponge_cut",
                                                 "sponge_block",
                                                 "none",
                                                 "rod",
                                                 "contact",
                                                 "contact-1",
                                                 "recording-1",
                                                 "current",
                                                 "sponge_cut@current",
                                                 "x",
                                                 "force",
                                                 "rm",
                                                 "../../etc/passwd",
                                                 "a\nb",
                                                 std::string("nul\0nul", 7),
                                                 "Übersteuert 力 🖐",
                                                 "0123456789abcdef",
                                                 "{\"content\": {}}",
                                                 "name = \"a\"\nkind = \"tap_1d\"\n",
                                                 "time_s,force_N,position_mm\n0,0,0\n1,1,1\n"};
    switch (below(8)) {
      case 0:
        return std::string(below(100'000), 'x');
      case 1: {
        std::string keys = "a";  // keys of many parts, in TOML
        for (std::size_t i = below(40'000); i > 0; --i) keys += ".a";
        return keys + " = 1";
      }
      case 2:
        return std::string(below(3'000), '[');
      default:
        return kTexts[below(kTexts.size())];
    }
  }

  void fill(Message& message, int depth) {
    const Descriptor& type = *message.GetDescriptor();
    for (int i = 0; i < type.field_count(); ++i) {
      const FieldDescriptor& field = *type.field(i);
      if (!chance(depth == 0 ? 0.7 : 0.5)) continue;
      if (!field.is_repeated()) {
        set(message, field, depth);
        continue;
      }
      for (std::size_t n = chance(0.05) ? 2'000 : below(4); n > 0; --n) add(message, field, depth);
    }
  }
  void set(Message& message, const FieldDescriptor& field, int depth) {
    const auto& access = *message.GetReflection();
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_DOUBLE:
        return access.SetDouble(&message, &field, number());
      case FieldDescriptor::CPPTYPE_FLOAT:
        return access.SetFloat(&message, &field, static_cast<float>(number()));
      case FieldDescriptor::CPPTYPE_INT32:
        return access.SetInt32(&message, &field, static_cast<std::int32_t>(integer()));
      case FieldDescriptor::CPPTYPE_INT64:
        return access.SetInt64(&message, &field, integer());
      case FieldDescriptor::CPPTYPE_UINT32:
        return access.SetUInt32(&message, &field, static_cast<std::uint32_t>(integer()));
      case FieldDescriptor::CPPTYPE_UINT64:
        return access.SetUInt64(&message, &field, static_cast<std::uint64_t>(integer()));
      case FieldDescriptor::CPPTYPE_BOOL:
        return access.SetBool(&message, &field, chance(0.5));
      case FieldDescriptor::CPPTYPE_ENUM:
        return access.SetEnumValue(&message, &field, static_cast<int>(below(20)) - (chance(0.1) ? 100 : 0));
      case FieldDescriptor::CPPTYPE_STRING:
        return access.SetString(&message, &field, text());
      case FieldDescriptor::CPPTYPE_MESSAGE:
        if (depth < kMaxDepth) fill(*access.MutableMessage(&message, &field), depth + 1);
        return;
    }
  }
  void add(Message& message, const FieldDescriptor& field, int depth) {
    const auto& access = *message.GetReflection();
    switch (field.cpp_type()) {
      case FieldDescriptor::CPPTYPE_DOUBLE:
        return access.AddDouble(&message, &field, number());
      case FieldDescriptor::CPPTYPE_ENUM:
        return access.AddEnumValue(&message, &field, static_cast<int>(below(20)));
      case FieldDescriptor::CPPTYPE_STRING:
        return access.AddString(&message, &field, text().substr(0, 100));
      case FieldDescriptor::CPPTYPE_MESSAGE:
        if (depth < kMaxDepth) fill(*access.AddMessage(&message, &field), depth + 1);
        return;
      default:
        return;  // the contract repeats no others in requests
    }
  }
  void spoil(std::string& bytes) {
    switch (below(3)) {
      case 0:
        bytes.resize(below(bytes.size() + 1));
        return;
      case 1:
        bytes.insert(below(bytes.size() + 1), "\x0a\x04\xfc\x62\x65\x72");  // a string that is not UTF-8
        return;
      default:
        for (std::size_t n = 1 + below(4); n > 0 && !bytes.empty(); --n) {
          char& byte = bytes[below(bytes.size())];
          byte = static_cast<char>(byte ^ (1 << below(8)));
        }
    }
  }

  std::mt19937_64 random_;
};

}  // namespace hapticd::fuzz
