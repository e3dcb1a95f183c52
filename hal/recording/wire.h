#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace hapticd::recording {

// The fields of a protobuf message, for the two messages of a recording: a reader of a recording needs
// neither protobuf nor the generated code.

void put_varint(std::uint64_t number, std::string& out);
/// Puts a number field; a zero is left out, as proto3 does.
void put_number_field(std::uint32_t field, std::uint64_t number, std::string& out);
/// Puts a text, bytes or message field; an empty one is left out.
void put_bytes_field(std::uint32_t field, std::string_view bytes, std::string& out);

/// One field as written in a message.
struct WireField {
  std::uint32_t number = 0;
  std::uint64_t value = 0;  ///< of a number
  std::string_view bytes;   ///< of a text, bytes or message
};

/// Takes the fields off the front of a message.
class WireReader {
 public:
  explicit WireReader(std::string_view message) : rest_(message) {}
  /// False at the end, and if the message is damaged.
  bool next(WireField& field);
  bool failed() const { return failed_; }

 private:
  bool take_varint(std::uint64_t& number);
  std::string_view rest_;
  bool failed_ = false;
};

}  // namespace hapticd::recording
