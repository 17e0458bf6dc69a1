"""Where the paper stops: six joints, joint space, random frames, other budgets, and MuPSO's ingredients one by one."""
