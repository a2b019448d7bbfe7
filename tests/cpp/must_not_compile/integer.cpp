// error: palpate::Rls: Real must be float or double
#include <palpate/estimator/rls.hpp>

int main() { return palpate::Rls<int>().update(1, 1).accepted; }
