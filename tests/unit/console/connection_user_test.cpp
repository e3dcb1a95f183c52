#include "client/console/access/connection_user.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <boost/asio/io_context.hpp>
#include <sstream>
#include <string>

namespace hapticd::console {
namespace {

using boost::asio::ip::make_address;
using Tcp = boost::asio::ip::tcp;

const char* const kHead =
    "  sl  local_address rem_address   st tx_queue rx_queue tr tm->when retrnsmt   uid  timeout inode\n";

std::optional<unsigned> user_of(const std::string& lines, const Tcp::endpoint& peer,
                                const Tcp::endpoint& own) {
  std::istringstream list(kHead + lines);
  return user_in_list(list, peer, own);
}

TEST(ConnectionUser, IsFoundByBothEnds) {
  const Tcp::endpoint peer(make_address("127.0.0.1"), 50176);
  const Tcp::endpoint own(make_address("127.0.0.1"), 50080);
  const std::string this_end =
      "   0: 0100007F:C3A0 0100007F:C400 01 00000000:00000000 00:00000000 00000000     7        0 640 1 0 20 "
      "4\n";
  const std::string other_port =
      "   1: 0100007F:C400 0100007F:C3A1 01 00000000:00000000 00:00000000 00000000     8        0 641 1 0 20 "
      "4\n";
  const std::string other_end =
      "   2: 0100007F:C400 0100007F:C3A0 01 00000000:00000000 00:00000000 00000000  1000        0 642 1 0 20 "
      "4\n";
  EXPECT_EQ(user_of(this_end + other_port + other_end, peer, own), 1000U);
  EXPECT_EQ(user_of(this_end + other_port, peer, own), std::nullopt);
  EXPECT_EQ(user_of("   2: 0100007F:C400 0100007F:C3A0 01\n", peer, own), std::nullopt)
      << "a line that is cut";
}

TEST(ConnectionUser, IsFoundForBothKindsOfAddresses) {
  const Tcp::endpoint peer(make_address("::1"), 50176);
  const Tcp::endpoint own(make_address("::1"), 50080);
  EXPECT_EQ(user_of("   0: 00000000000000000000000001000000:C400 00000000000000000000000001000000:C3A0 01 "
                    "00000000:00000000 00:00000000 00000000  1001        0 642 1 0 20 4\n",
                    peer, own),
            1001U);
}

TEST(ConnectionUser, IsThatOfTheKernel) {
  boost::asio::io_context context;
  Tcp::acceptor acceptor(context, {make_address("127.0.0.1"), 0});
  Tcp::socket there(context);
  there.connect(acceptor.local_endpoint());
  const Tcp::socket here = acceptor.accept();
  EXPECT_EQ(user_of_connection(here.remote_endpoint(), here.local_endpoint()), geteuid());
}

}  // namespace
}  // namespace hapticd::console
