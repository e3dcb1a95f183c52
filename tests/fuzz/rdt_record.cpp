// Datagrams of a Net F/T box, and what is made of their numbers and status words.

#include "hal/netft/rdt_record.h"

#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "hal/netft/rdt_sequence.h"
#include "hal/netft/rdt_status.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace hapticd::netft;
  std::array<RdtRecord, kRdtMostRecords> records;
  const std::size_t count = parse_rdt_datagram({data, size}, records);
  if (count > kRdtMostRecords || (count > 0 && count * kRdtRecordBytes != size)) std::abort();
  RdtSequence sequence;
  for (std::size_t i = 0; i < count; ++i) {
    sequence.judge(records[i].rdt_sequence, (records[i].ft_sequence & 1U) != 0);
    const RdtFitness fitness = judge_rdt_status(records[i].status);
    const bool silent = describe_rdt_status(records[i].status).empty();
    // Whatever is not well has a name.
    if (silent != !(fitness.faulty || fitness.saturated || fitness.warning)) std::abort();
  }
  return 0;
}
