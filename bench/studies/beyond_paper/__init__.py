"""Beyond the paper: six joints, joint space, random frames, other budgets, the ingredients of MuPSO one by one."""
