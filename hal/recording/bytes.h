#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <map>
#include <string>
#include <string_view>

namespace hapticd::recording {

static_assert(std::endian::native == std::endian::little, "as all that hapticd runs on");

/// Appends a number, little-endian.
template <class T>
void put(T number, std::string& out) {
  char bytes[sizeof(T)];
  std::memcpy(bytes, &number, sizeof(T));
  out.append(bytes, sizeof(T));
}

/// Puts a text after its length.
inline void put_text(std::string_view text, std::string& out) {
  put(static_cast<std::uint32_t>(text.size()), out);
  out += text;
}

using Texts = std::map<std::string, std::string>;

/// Puts a map of texts after its length in bytes.
void put_texts(const Texts& texts, std::string& out);

/// Takes numbers and texts off the front of bytes that someone else may have written. After the first that is
/// not there all are zero or empty, and failed() is true.
class ByteReader {
 public:
  explicit ByteReader(std::string_view bytes) : rest_(bytes) {}

  template <class T>
  T take() {
    T number{};
    if (const std::string_view bytes = take_bytes(sizeof(T)); bytes.size() == sizeof(T)) {
      std::memcpy(&number, bytes.data(), sizeof(T));
    }
    return number;
  }
  std::string_view take_bytes(std::uint64_t count) {
    if (failed_ || count > rest_.size()) {
      failed_ = true;
      return {};
    }
    const std::string_view bytes = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return bytes;
  }
  std::string_view take_text() { return take_bytes(take<std::uint32_t>()); }
  Texts take_texts();

  std::string_view rest() const { return rest_; }
  bool failed() const { return failed_; }

 private:
  std::string_view rest_;
  bool failed_ = false;
};

}  // namespace hapticd::recording
