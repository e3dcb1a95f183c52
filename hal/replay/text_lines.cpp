#include "hal/replay/text_lines.h"

#include <algorithm>
#include <cstdint>

namespace hapticd::replay {
namespace {

constexpr std::size_t kPieceBytes = 65'536;
constexpr std::string_view kUtf8Mark = "\xEF\xBB\xBF";
constexpr std::uint32_t kReplacement = 0xFFFD;

void append_utf8(std::string& text, std::uint32_t code) {
  const auto byte = [&text](std::uint32_t value) { text += static_cast<char>(value); };
  if (code < 0x80) {
    byte(code);
  } else if (code < 0x800) {
    byte(0xC0 | code >> 6);
    byte(0x80 | (code & 0x3F));
  } else if (code < 0x10000) {
    byte(0xE0 | code >> 12);
    byte(0x80 | (code >> 6 & 0x3F));
    byte(0x80 | (code & 0x3F));
  } else {
    byte(0xF0 | code >> 18);
    byte(0x80 | (code >> 12 & 0x3F));
    byte(0x80 | (code >> 6 & 0x3F));
    byte(0x80 | (code & 0x3F));
  }
}

bool is_high(std::uint32_t unit) {
  return unit >= 0xD800 && unit < 0xDC00;
}
bool is_low(std::uint32_t unit) {
  return unit >= 0xDC00 && unit < 0xE000;
}

}  // namespace

bool TextLines::open(const std::string& path) {
  stream_.open(path, std::ios::binary);
  return stream_.is_open();
}

void TextLines::append_utf16(std::string_view bytes) {
  undecoded_.append(bytes);
  const std::size_t units = undecoded_.size() / 2;
  const auto unit_at = [this](std::size_t i) {
    const auto first = static_cast<unsigned char>(undecoded_[2 * i]);
    const auto second = static_cast<unsigned char>(undecoded_[2 * i + 1]);
    return static_cast<std::uint32_t>(encoding_ == Encoding::kUtf16Big ? first << 8 | second
                                                                       : second << 8 | first);
  };
  std::size_t used = 0;
  for (; used < units; ++used) {
    std::uint32_t code = unit_at(used);
    if (is_high(code)) {
      if (used + 1 == units) break;  // its other half is in the next piece
      const std::uint32_t low = unit_at(used + 1);
      if (is_low(low)) {
        code = 0x10000 + ((code - 0xD800) << 10) + (low - 0xDC00);
        ++used;
      } else {
        code = kReplacement;
      }
    } else if (is_low(code)) {
      code = kReplacement;
    }
    append_utf8(text_, code);
  }
  undecoded_.erase(0, 2 * used);
}

bool TextLines::fill() {
  text_.erase(0, begin_);
  begin_ = 0;
  std::string piece(kPieceBytes, '\0');
  stream_.read(piece.data(), static_cast<std::streamsize>(piece.size()));
  piece.resize(static_cast<std::size_t>(stream_.gcount()));
  if (piece.empty()) return false;
  std::string_view bytes = piece;
  if (is_first_) {
    is_first_ = false;
    // Without a mark, the zero byte next to an ASCII character shows the order.
    const bool little =
        bytes.starts_with("\xFF\xFE") || (bytes.size() > 1 && bytes[0] != '\0' && bytes[1] == '\0');
    const bool big =
        bytes.starts_with("\xFE\xFF") || (bytes.size() > 1 && bytes[0] == '\0' && bytes[1] != '\0');
    if (little) encoding_ = Encoding::kUtf16Little;
    if (big) encoding_ = Encoding::kUtf16Big;
    if (bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF")) bytes.remove_prefix(2);
    if (bytes.starts_with(kUtf8Mark)) bytes.remove_prefix(kUtf8Mark.size());
  }
  if (encoding_ == Encoding::kUtf8) {
    text_.append(bytes);
  } else {
    append_utf16(bytes);
  }
  return true;
}

TextLines::State TextLines::next(std::string_view& line) {
  std::size_t looked_at = begin_;
  for (;;) {
    if (skips_line_feed_ && begin_ < text_.size()) {
      if (text_[begin_] == '\n') looked_at = ++begin_;
      skips_line_feed_ = false;
    }
    const auto from = text_.begin() + static_cast<std::ptrdiff_t>(looked_at);
    const auto end = std::find_if(from, text_.end(), [](char c) { return c == '\n' || c == '\r'; });
    const auto length = static_cast<std::size_t>(end - text_.begin()) - begin_;
    if (length > kMaxLineBytes) {
      ++number_;
      return State::kTooLong;
    }
    is_unfinished_ = end == text_.end();
    if (is_unfinished_) {
      if (fill()) {
        looked_at = length;
        continue;
      }
      if (stream_.bad()) return State::kFailed;
      if (length == 0) return State::kEnd;
    }
    ++number_;
    line = std::string_view(text_).substr(begin_, length);
    begin_ += length + (is_unfinished_ ? 0 : 1);
    skips_line_feed_ = !is_unfinished_ && *end == '\r';
    return State::kLine;
  }
}

}  // namespace hapticd::replay
