/* A small family of processes whose CPU time and memory are known: the tests' stand-in for renderers that fork. */
#define _GNU_SOURCE
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/wait.h>
#include <time.h>
#include <unistd.h>

static void burn(double seconds) /* of CPU time of this process */
{
    struct timespec t;
    do
        clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    while (t.tv_sec + 1e-9 * t.tv_nsec < seconds);
}
static void hold(size_t megabytes)
{
    memset(malloc(megabytes * 1000000), 1, megabytes * 1000000);
}
static int ends[2];
static void until(char *word) /* read a byte of it, or nothing once all descendants have ended */
{
    close(ends[1]);
    if (read(ends[0], word, 1) < 0) abort();
}
static void child(double seconds, size_t megabytes) /* it lives a while longer, so that a tick sees it */
{
    if (fork()) return;
    hold(megabytes);
    burn(seconds);
    usleep(150000);
    _exit(0);
}

int main(int argc, char **argv)
{
    const char *mode = argc > 1 ? argv[1] : "";
    char word[1];
    if (pipe(ends)) abort();
    if (!strcmp(mode, "short")) burn(0.005);
    if (!strcmp(mode, "holds")) hold(100);
    if (!strcmp(mode, "waits")) child(0.3, 120), hold(20), wait(NULL);
    if (!strcmp(mode, "does not wait")) child(0.3, 120), until(word);
    if (!strcmp(mode, "orphan") && !fork()) child(0.3, 120), _exit(0); /* its parent ends first */
    if (!strcmp(mode, "orphan")) until(word);
    if (!strcmp(mode, "leaves") && !fork()) {
        setsid(), printf("%d\n", getpid()), fflush(stdout);
        burn(0.1);
        if (write(ends[1], "x", 1) != 1) abort();
        burn(60);
    }
    if (!strcmp(mode, "leaves")) until(word);
    for (int n = 0; n < 50 && !strcmp(mode, "between ticks"); n++) {
        if (!fork()) burn(0.003), _exit(0);
        wait(NULL);
    }
    return 0;
}
