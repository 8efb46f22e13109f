#pragma once

// CNT-1, CNT-2: of one frame.
struct Counts {
    long long primary = 0, reflected = 0, transmitted = 0, shadow = 0, non_finite = 0;

    void operator+=(const Counts& more)
    {
        primary += more.primary;
        reflected += more.reflected;
        transmitted += more.transmitted;
        shadow += more.shadow;
        non_finite += more.non_finite;
    }
};
