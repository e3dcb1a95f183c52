#include "client/cli/record/download.h"

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <fstream>

#include "client/cli/session/interrupt.h"
#include "client/cli/session/session.h"

namespace hapticd::cli {

namespace {

void check_room(std::uint64_t bytes, const std::string& path) {
  std::error_code failure;
  const auto folder = std::filesystem::absolute(path, failure).parent_path();
  const std::filesystem::space_info room = std::filesystem::space(folder, failure);
  if (failure || bytes <= room.available) return;
  throw LocalError("the disk has no room for the file", path, std::to_string(bytes) + " bytes",
                   std::to_string(room.available) + " bytes are free", "make room, or write it elsewhere");
}

}  // namespace

std::uint64_t download(client::RecordingStream stream, const std::string& path) {
  const std::string part = path + ".part";
  catch_interrupts();
  std::uint64_t bytes = 0;
  std::uint64_t total = 0;
  v1::RecordingPiece piece;
  std::ofstream file;
  bool has_part = false;
  try {
    for (;;) {
      const auto event = stream.next(piece, std::chrono::milliseconds(100));
      if (interrupted()) throw LocalError("interrupted", path);
      if (event == client::RecordingStream::Event::kEnded) break;
      if (event == client::RecordingStream::Event::kNothing) continue;
      // Not before the daemon has granted it: a refusal leaves no file.
      if (!file.is_open()) {
        total = piece.total_bytes();
        check_room(total, path);
        std::error_code ignored;
        std::filesystem::remove(part, ignored);  // of a download that was killed; a link would be followed
        file.open(part, std::ios::binary | std::ios::trunc);
        has_part = true;
        if (!file) throw LocalError("cannot write the file", path, "", "", "see the rights of its folder");
      }
      bytes += piece.data().size();
      if (bytes > total) {
        throw LocalError("the daemon sends more than it announced", path, std::to_string(bytes) + " bytes",
                         std::to_string(total) + " bytes");
      }
      file.write(piece.data().data(), static_cast<std::streamsize>(piece.data().size()));
    }
    file.close();
    if (!file) throw LocalError("the file could not be written in full", path, "", "", "is the disk full?");
    std::filesystem::rename(part, path);
  } catch (...) {
    std::error_code ignored;
    if (has_part) std::filesystem::remove(part, ignored);
    throw;
  }
  return bytes;
}

}  // namespace hapticd::cli
