from rayrace.main import main

main()
