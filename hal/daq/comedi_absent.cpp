#include "hal/daq/board_factory.h"

// Stands in for comedi_board.cpp if libcomedi was not found at build time.
namespace hapticd::daq {

hal::Result<std::shared_ptr<Board>> create_comedi_board(const BoardConfig& config) {
  return hal::Error{"this build cannot drive boards: it was built without libcomedi", "board",
                    config.comedi.device, "",
                    "install libcomedi-dev and build again, or use a Net F/T box and the vendor's library"};
}

bool has_comedi() noexcept {
  return false;
}

}  // namespace hapticd::daq
