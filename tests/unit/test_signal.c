// @ranks 1
/* A request to stop that arrives while signals are held back is delivered afterwards, once. */
#include "../test.h"
#include <sbsignal.h>

static volatile sig_atomic_t seen;

static void count(int number)
{
  (void)number;
  seen++;
}

int main(int argc, char **argv)
{
  sigset_t before;

  SB_TEST_BEGIN(argc, argv);
  (void)signal(SIGTERM, count);
  SbSignalsHold(&before);
  (void)raise(SIGTERM);
  SB_CHECK(seen == 0, "delivered %d times while held back", (int)seen);
  SbSignalsRelease(&before);
  SB_CHECK(seen == 1, "delivered %d times afterwards", (int)seen);
  (void)raise(SIGTERM);
  SB_CHECK(seen == 2, "no longer delivered");
  SB_TEST_END();
}
