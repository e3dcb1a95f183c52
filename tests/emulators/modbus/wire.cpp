#include "tests/emulators/modbus/wire.h"

namespace hapticd::test {

namespace {

unsigned word_at(const Bytes& bytes, std::size_t i) {
  return bytes[i] * 256U + bytes[i + 1];
}

void add_word(Bytes& bytes, unsigned word) {
  bytes.push_back(static_cast<std::uint8_t>(word / 256U));
  bytes.push_back(static_cast<std::uint8_t>(word % 256U));
}

}  // namespace

Bytes refusal(const Bytes& request, int code) {
  return {static_cast<std::uint8_t>(request.empty() ? 0x80 : request[0] + 0x80),
          static_cast<std::uint8_t>(code)};
}

Bytes answer(const Bytes& request, DriveRegisters& registers, EmulatedMotor& motor,
             const RegisterFaults& faults) {
  if (request.size() < 5) return refusal(request, 3);
  const unsigned function = request[0];
  const unsigned address = word_at(request, 1);
  const unsigned second = word_at(request, 3);
  Bytes reply{request[0]};
  int code = 0;
  if (function == 3 || function == 4) {
    std::vector<std::uint16_t> words;
    if (second < 1 || second > 125) return refusal(request, 3);
    code = registers.read_words(function == 4, address, second, motor, faults, words);
    reply.push_back(static_cast<std::uint8_t>(2 * words.size()));
    for (const std::uint16_t word : words) add_word(reply, word);
  } else if (function == 1 || function == 2) {
    std::vector<bool> bits;
    if (second < 1 || second > 2000) return refusal(request, 3);
    code = registers.read_bits(function == 2, address, second, motor, bits);
    Bytes packed((bits.size() + 7) / 8, 0);
    for (std::size_t i = 0; i < bits.size(); ++i) {
      if (bits[i]) packed[i / 8] = static_cast<std::uint8_t>(packed[i / 8] | (1U << (i % 8)));
    }
    reply.push_back(static_cast<std::uint8_t>(packed.size()));
    reply.insert(reply.end(), packed.begin(), packed.end());
  } else if (function == 5) {
    if (second != 0xFF00 && second != 0) return refusal(request, 3);
    code = registers.write_bits(address, {second != 0}, motor);
    reply = request;
  } else if (function == 6) {
    code = registers.write_words(address, {static_cast<std::uint16_t>(second)}, motor);
    reply = request;
  } else if (function == 16) {
    if (request.size() < 6 || request.size() != 6U + request[5] || request[5] != 2 * second)
      return refusal(request, 3);
    std::vector<std::uint16_t> words;
    for (std::size_t i = 6; i + 1 < request.size(); i += 2)
      words.push_back(static_cast<std::uint16_t>(word_at(request, i)));
    code = registers.write_words(address, words, motor);
    add_word(reply, address);
    add_word(reply, second);
  } else {
    return refusal(request, 1);
  }
  return code != 0 ? refusal(request, code) : reply;
}

std::uint16_t crc16(const Bytes& bytes) {
  unsigned crc = 0xFFFF;
  for (const std::uint8_t byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1U) != 0 ? (crc >> 1U) ^ 0xA001U : crc >> 1U;
  }
  return static_cast<std::uint16_t>(crc);
}

std::optional<std::size_t> serial_request_length(const Bytes& received) {
  if (received.size() < 2) return std::nullopt;
  if (received[1] != 15 && received[1] != 16) return 8;
  if (received.size() < 7) return std::nullopt;
  return 9U + received[6];
}

}  // namespace hapticd::test
